"""``./pose calibrate board``: extrinsics of cameras from images of a board; prints the board too.

./pose calibrate board --print board.pdf                       the board, to be printed at 100 %
./pose calibrate board left=DIR right=DIR -o extrinsics.yaml   from folders of images
./pose calibrate board BAG -o extrinsics.yaml                  from a bag with image topics
./pose calibrate board --live left right -o extrinsics.yaml    from the running cameras
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from pose_calibration.board.camera import Camera, camera_from_info, load_camera
from pose_calibration.board.collecting import BoardCollector
from pose_calibration.board.detection import BoardDetector, BoardView
from pose_calibration.board.extrinsics import board_extrinsics
from pose_calibration.board.images import grey_from_message, paired_files, read_grey
from pose_calibration.board.solution import BoardCalibration, calibrate_board
from pose_calibration.board.target import PAPERS, Board, BoardParameters
from pose_calibration.files.extrinsics_file import save_extrinsics
from pose_calibration.floor.floor import KnownMounting
from pose_core.api import Extrinsics
from pose_core.errors import InputError, ParameterError
from pose_core.parameters import add_arguments, from_arguments
from pose_core.stamps import nanoseconds
from pose_fusion.calibration_lines import floor_line
from pose_io.bags import open_bag
from pose_node.command_line import add_option, check_folder_of
from pose_node.plain_console import progress_bar

ENDS = {"first": 0, "last": -1}


@dataclass(frozen=True, kw_only=True)
class Found:
    """Views of the board from a source of images."""

    cameras: Sequence[str]  # their names, the reference first
    instants: Sequence[Mapping[str, BoardView]]
    names: Sequence[str]  # of the instants
    intrinsics: Mapping[str, Camera] = field(default_factory=dict)  # published with the images


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="pose calibrate board",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "source", nargs="*", help="NAME=FOLDER of each camera, the reference first; or one bag"
    )
    parser.add_argument("-o", "--output", type=Path, help="the YAML to write")
    parser.add_argument("--print", type=Path, metavar="PDF", help="write the board and end")
    parser.add_argument("--paper", choices=tuple(PAPERS), default="A4", help="(default: A4)")
    parser.add_argument(
        "--live", nargs="+", metavar="NAME", help="watch these cameras, the reference first"
    )
    parser.add_argument("--cameras", nargs="+", metavar="NAME", help="of the bag, reference first")
    parser.add_argument(
        "--info", nargs="+", default=[], metavar="NAME=YAML", help="camera info files (intrinsics)"
    )
    add_option(parser, "--image-topic", "kinect_{name}/image_raw", "of each camera")
    add_option(parser, "--info-topic", "kinect_{name}/camera_info", "of each camera")
    skew = "largest difference of stamps [s] in a view of the standing board"
    add_option(parser, "--max-skew", 0.1, skew)
    parser.add_argument(
        "--floor-view",
        metavar="NAME",
        help="the image, without suffix, in which the board lies on the floor; or first, last",
    )
    parser.add_argument("--height", type=float, help="of the reference above the floor [m]")
    parser.add_argument("--tilt", type=float, help="of the reference, downwards [deg]")
    add_arguments(parser.add_argument_group("board"), BoardParameters)
    return parser


def named(entries: Sequence[str], what: str) -> dict[str, Path]:
    """Parse ``NAME=PATH`` arguments.

    Raises:
        InputError: If one is not of this form, or a name occurs twice.
    """
    result: dict[str, Path] = {}
    for entry in entries:
        name, equals, path = entry.partition("=")
        if not equals or not name or not path or name in result:
            raise InputError(f"'{entry}' is not a {what}: expected NAME=PATH, each name once")
        result[name] = Path(path)
    return result


def detect_in_folders(folders: Mapping[str, Path], board: Board, progress: Progress) -> Found:
    """Find the board in image files."""
    detector = BoardDetector(board)
    pairs = paired_files(folders)
    instants = []
    for paths in progress.track(pairs, description="looking for the board"):
        views = {camera: detector.detect(read_grey(path)) for camera, path in paths.items()}
        instants.append({camera: view for camera, view in views.items() if view})
    names = [next(iter(paths.values())).stem for paths in pairs]
    return Found(cameras=list(folders), instants=instants, names=names)


def detect_in_bag(path: Path, arguments: argparse.Namespace, board: Board, bar: Progress) -> Found:
    """Find the board in a bag's images.

    Raises:
        InputError: If the bag cannot be read, or has no images of two cameras.
    """
    intrinsics: dict[str, Camera] = {}
    with_images: set[str] = set()
    with open_bag(path) as bag:
        prefix, _, suffix = arguments.image_topic.partition("{name}")
        plain = [topic.removesuffix("/compressed") for topic in bag.topics]
        images = [topic.removesuffix(suffix) for topic in plain if topic.endswith(suffix)]
        named = {topic.rpartition(prefix)[2] for topic in images if prefix in topic}
        names = arguments.cameras or sorted(named)
        ends = {arguments.image_topic.format(name=name): name for name in names}
        ends |= {f"{end}/compressed": name for end, name in ends.items()}
        infos = {arguments.info_topic.format(name=name): name for name in names}
        chosen = {
            topic: (known[end], known is infos)
            for topic in bag.topics
            for known in (ends, infos)
            for end in known
            if topic.lstrip("/") == end or topic.endswith(f"/{end}")
        }
        if len({name for name, is_info in chosen.values() if not is_info}) < 2:
            raise InputError(
                f"{path} has no images of two cameras at {arguments.image_topic}: found "
                f"{', '.join(sorted(bag.topics))}; see --image-topic"
            )
        collector = BoardCollector(board, names, arguments.max_skew)
        task = bar.add_task("looking for the board", total=1.0)
        for message in bag.messages(list(chosen)):
            bar.update(task, completed=bag.share_before(message.stamp_ns))
            name, is_info = chosen[message.topic]
            content = bag.deserialize(message)
            if is_info:
                intrinsics[name] = camera_from_info(content)
            else:
                with_images.add(name)
                collector.add(name, nanoseconds(content.header.stamp), grey_from_message(content))
    return _collected(collector, arguments.cameras or sorted(with_images), intrinsics)


def detect_live(arguments: argparse.Namespace, board: Board, bar: Progress) -> Found:
    """Find the board in the running cameras' images, until there are enough."""
    from pose_fusion.nodes.board_images import collect_live  # ROS only where it is wanted

    collector = BoardCollector(board, arguments.live, arguments.max_skew)
    images, infos = (
        {name: topic.format(name=name) for name in arguments.live}
        for topic in (arguments.image_topic, arguments.info_topic)
    )
    task = bar.add_task("", total=1.0)

    def show(trouble: str) -> None:
        text = trouble or collector.missing
        if not collector.counters["images"] and not trouble:
            text = "waiting for " + ", ".join(images.values())
        bar.update(task, completed=collector.progress, description=text)

    return _collected(collector, arguments.live, collect_live(collector, images, infos, show))


def _collected(
    collector: BoardCollector, cameras: Sequence[str], intrinsics: Mapping[str, Camera]
) -> Found:
    instants = collector.instants
    names = [str(index) for index in range(len(instants))]
    return Found(cameras=cameras, instants=instants, names=names, intrinsics=intrinsics)


def result_table(calibration: BoardCalibration, extrinsics: Extrinsics) -> Table:
    """Pose of each camera with its uncertainty."""
    reference = extrinsics.reference
    table = Table(title=f"cameras, seen from '{reference}'", show_edge=False)
    for heading in ("camera", "views", "image covered", "distance", "known to", "intrinsics"):
        table.add_column(heading, justify="left" if heading == "camera" else "right")
    for name, camera in calibration.cameras.items():
        views, covered = str(calibration.pairs[name]), f"{calibration.coverage[name].share:.0%}"
        distance = known_to = ""
        if name != reference:
            distance = f"{np.linalg.norm(extrinsics.T_reference_sensor[name][:3, 3]):.3f} m"
            known_to = f"{calibration.position_stddev[name] * 1e3:.1f} mm, "
            known_to += f"{np.degrees(calibration.rotation_stddev[name]):.2f}°"
        table.add_row(name, views, covered, distance, known_to, camera.source)
    return table


def main(given: list[str]) -> None:
    """Run with the arguments that follow ``board``."""
    arguments = make_parser().parse_args(given)
    board = Board(from_arguments(BoardParameters, arguments))
    if arguments.print is not None:
        from pose_calibration.board.printing import print_board  # slow to load

        print_board(board, arguments.print, arguments.paper)
        print(f"{arguments.print}: print at 100 %, measure the line, then the squares")
        return
    if arguments.output is None:
        raise InputError("no output: name the YAML to write with -o, or the page with --print")
    check_folder_of(arguments.output)
    infos = {name: load_camera(path) for name, path in named(arguments.info, "camera info").items()}
    with progress_bar(Console(stderr=True)) as bar:
        found = _detect(arguments, board, bar)
    names = found.cameras
    strange = sorted(set(infos) - set(names))
    if strange:
        raise InputError(f"--info names {', '.join(strange)}, expected some of {', '.join(names)}")
    cameras = {name: infos.get(name, found.intrinsics.get(name)) for name in names}
    calibration = calibrate_board(board, found.instants, cameras)
    tilt = None if arguments.tilt is None else float(np.radians(arguments.tilt))
    mounting = KnownMounting(tilt=tilt, height=arguments.height)
    floor = _floor_instant(arguments.floor_view, found.names)
    extrinsics = board_extrinsics(calibration, mounting, floor)
    save_extrinsics(arguments.output, extrinsics)
    _print_result(calibration, extrinsics, found)
    print(f"{arguments.output}: {', '.join(extrinsics.sensors)}")


def _detect(arguments: argparse.Namespace, board: Board, bar: Progress) -> Found:
    """Find the board in the source that the arguments name."""
    if arguments.live:
        if len(set(arguments.live)) < 2 or arguments.source:
            raise InputError("--live wants two or more different cameras, and no other source")
        return detect_live(arguments, board, bar)
    if len(arguments.source) == 1 and "=" not in arguments.source[0]:
        return detect_in_bag(Path(arguments.source[0]), arguments, board, bar)
    folders = named(arguments.source, "folder of images")
    if len(folders) < 2:
        raise InputError("expected NAME=FOLDER of two or more cameras, a bag, or --live NAME NAME")
    return detect_in_folders(folders, board, bar)


def _floor_instant(wanted: str | None, names: Sequence[str]) -> int | None:
    if wanted is None:
        return None
    if wanted in ENDS and names:
        return ENDS[wanted] % len(names)
    if wanted not in names:
        raise ParameterError(f"--floor-view {wanted}: no image of that name among {len(names)}")
    return names.index(wanted)


def _print_result(calibration: BoardCalibration, extrinsics: Extrinsics, found: Found) -> None:
    console = Console(soft_wrap=True)
    console.print(result_table(calibration, extrinsics))
    print(f"reprojection {calibration.rms_px:.2f} px over all corners")
    for index, reason in sorted(calibration.left_out.items()):
        print(f"view {found.names[index]} left out: {reason}")
    for name, seen in calibration.coverage.items():
        if seen.share < 1.0:
            print(f"'{name}' never had the board {seen.missing_text} of its image")
    if extrinsics.floor is not None:
        print(floor_line(extrinsics))
