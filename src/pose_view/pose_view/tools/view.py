"""``view``: the page of a recording, or of the running graph."""

import argparse
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from pose_core.api import EstimateBlock, Extrinsics, ImuUse, PeoplePipeline, PipelineParameters
from pose_core.errors import PoseError
from pose_core.parameters import add_arguments, from_arguments
from pose_fusion.session_extrinsics import find_extrinsics
from pose_io.bag_samples import BagFrames
from pose_io.bags import BagReader, open_bag
from pose_io.topics import imu_topics, sensor_topics
from pose_node.command_line import add_option, run_tool
from pose_node.plain_console import add_share
from pose_view.messages import estimate_snapshot
from pose_view.parameters import ViewParameters
from pose_view.recorded import Recorded
from pose_view.snapshot import BodySnapshot
from pose_view.web.viewer import Viewer

FUSED = "fused"
SETTINGS: Mapping[str, Mapping[str, Any]] = {
    "kinect": {"use_imus": False},
    "imu": {"estimator": "imu"},
    FUSED: {},
}
"""Parameters of the fusion by kind of body: the suffix of its id, if it uses one kind of sensor."""


MAX_PEOPLE = 6
IDLE_S = 0.1  # [s] between checks for browsers


def missing_bodies(recorded: Recorded, bodies: tuple[str, ...], bag: BagReader) -> dict[str, str]:
    """The bodies that can be computed from a bag and were not recorded, each with its kind.

    Args:
        recorded: Content of the bag.
        bodies: Requested ids.
        bag: The open bag.
    """
    if not recorded.raw:
        return {}
    has_imus, is_raw = bool(imu_topics(bag)), not recorded.bodies
    kinds = {FUSED} if is_raw else set()
    # Without IMUs, the cameras alone are the same as the fusion.
    kinds |= {"kinect", "imu"} if has_imus else set() if is_raw else {"kinect"}
    endings = {body: body.rpartition("_")[2] for body in bodies if body not in recorded.bodies}
    found = {body: end if end in SETTINGS else FUSED for body, end in endings.items()}
    return {body: kind for body, kind in found.items() if kind in kinds}


def compute_bodies(
    bag: BagReader,
    kind: str,
    parameters: PipelineParameters,
    extrinsics: Extrinsics,
    progress: Callable[[float], None],
) -> tuple[dict[str, list[BodySnapshot]], Sequence[ImuUse], Sequence[str]]:
    """Run the fusion over a bag.

    Args:
        bag: An open bag.
        kind: Sensors to use, a key of :data:`SETTINGS`.
        parameters: Parameters of the fusion.
        extrinsics: The sensors' poses.
        progress: Called with the fraction done, 0 to 1.

    Returns:
        Snapshots by body, how the subject's IMUs were used, and lines about what is left out.

    Raises:
        PoseError: If the fusion fails.
    """
    bodies: dict[str, list[BodySnapshot]] = defaultdict(list)

    def show(body: str, block: EstimateBlock) -> None:
        bodies[body] += [estimate_snapshot(estimate) for estimate in block]

    pipeline = PeoplePipeline(replace(parameters, **SETTINGS[kind]), show, extrinsics)
    frames = BagFrames(bag, progress, imus=kind != "kinect", clocks=extrinsics.clocks)
    for each in frames:
        pipeline.add(each)
    pipeline.flush()
    lines = [*frames.left_out]
    if not bodies:
        why = "no IMU could be used" if pipeline.status == "tracking" else pipeline.status
        lines.append(f"without {parameters.subject}: {why}")
    return bodies, pipeline.subject.imu_uses, lines


def main() -> None:
    """Entry point of the executable."""
    run_tool(lambda: view(sys.argv[1:]))


def view(words: Sequence[str]) -> int:
    """Run ``view`` with these arguments; returns its exit code."""
    options = _parser().parse_args(words)
    parameters = from_arguments(ViewParameters, options)
    if options.bag is None:
        from pose_view.nodes.viewer import run_viewer  # a recording needs no ROS

        run_viewer(vars(options))
    recorded = read(
        options.bag, parameters.bodies, person=options.person, max_people=options.max_people
    )
    viewer = Viewer(parameters, recorded=recorded)
    if viewer.server.opened:
        print(viewer.server.opened, flush=True)
    print(f"showing {options.bag} on {viewer.server.invitation} (Ctrl-C ends it)", flush=True)
    try:
        _play(viewer, recorded, parameters.rate)
    finally:
        viewer.server.stop()
    return 0


def read(
    path: Path, bodies: tuple[str, ...], *, person: str = "first", max_people: int = 1
) -> Recorded:
    """Read a recording and compute missing bodies.

    Args:
        path: A bag or a recording of skeletons.
        bodies: Ids of the requested bodies.
        person: The subject, by the rule of :class:`PersonChoice`.
        max_people: How many people's poses are computed.
    """
    console = Console(stderr=True)
    with open_bag(path) as bag, Progress(console=console, transient=True) as progress:
        recorded = Recorded(bag, add_share(progress, "reading"))
        if missing := missing_bodies(recorded, bodies, bag):
            sensors = tuple(sensor_topics(bag))
            fusion = PipelineParameters(sensors=sensors, person=person, max_people=max_people)
            _compute(recorded, missing, bag, fusion, progress, console)
    recorded.remarks = list(dict.fromkeys(recorded.remarks))  # each computation repeats some
    for line in recorded.remarks:
        print(line, file=sys.stderr)
    return recorded


def _compute(
    recorded: Recorded,
    missing: Mapping[str, str],
    bag: BagReader,
    fusion: PipelineParameters,
    progress: Progress,
    console: Console,
) -> None:
    """Add the missing bodies to a recording, or remarks why not."""
    try:
        say = partial(console.print, soft_wrap=True)
        extrinsics = find_extrinsics(bag, fusion.sensors, say)
    except PoseError as error:
        recorded.remarks.append(f"without {', '.join(missing)}: {error}")
        return
    recorded.sensors = {name: extrinsics.T_map_sensor(name) for name in extrinsics.sensors}
    for body, kind in missing.items():
        people = fusion.max_people if kind == FUSED else 1
        chosen = replace(fusion, subject=body, max_people=people)
        show = add_share(progress, f"computing {body}")
        try:
            computed, uses, left_out = compute_bodies(bag, kind, chosen, extrinsics, show)
        except PoseError as error:
            recorded.remarks.append(f"without {body}: {error}")
            continue
        recorded.remarks += left_out
        recorded.add_imu_uses(body, uses)
        for found, snapshots in computed.items():
            recorded.add_body(found, snapshots)


def _play(viewer: Viewer, recorded: Recorded, rate: float) -> None:
    """Update the page while a browser is connected."""
    assert viewer.playback is not None
    while True:
        if not viewer.server.has_visitors:
            time.sleep(IDLE_S)
            continue
        started = time.monotonic()
        now_s = viewer.playback.time_s()
        viewer.show(recorded.snapshot(now_s), recorded.track, now_s, 0.0)
        time.sleep(max(0.0, 1.0 / rate - (time.monotonic() - started)))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="pose view",
        description="Show a recording in the browser: the person as the cameras alone, the fusion"
        " and the IMUs alone see it, side by side, with curves of their angles. Without BAG, show"
        " the graph that runs.",
    )
    parser.add_argument(
        "bag", nargs="?", metavar="BAG", type=Path, help="a bag or a recording of skeletons"
    )
    subject = "the subject, where nobody was recorded: first, nearest, imus, or a sensor's id"
    add_option(parser, "--person", "first", subject)
    parser.add_argument(
        "--max-people",
        type=int,
        choices=range(1, MAX_PEOPLE + 1),
        default=1,
        metavar="N",
        help="how many people's poses are computed, where none were recorded (%(default)s)",
    )
    add_arguments(parser, ViewParameters)
    return parser
