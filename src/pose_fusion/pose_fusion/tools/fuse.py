"""Fuse a recorded bag with the code of the fusion node, as fast as the machine allows."""

import argparse
import gc
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.progress import Progress, TimeRemainingColumn

from pose_calibration.imus.section import load_alignments_if_any
from pose_core.api import (
    AlignmentHistory,
    EstimateBlock,
    Extrinsics,
    PeoplePipeline,
    SensorsToSegments,
    body_model_of,
    first_pass,
    load_body_shape,
    save_body_shape,
    with_measured_delay,
)
from pose_core.errors import InputError, PoseError
from pose_core.parameters import add_arguments, from_mapping, specs, values_from_ros_yaml
from pose_fusion.estimate_writer import EstimateWriter
from pose_fusion.fusion_lines import closing_lines
from pose_fusion.parameters import FusionNodeParameters
from pose_fusion.session_extrinsics import Say, checked_sensors, find_extrinsics
from pose_fusion.tools.compiling import prepare_visibly
from pose_io.bag_samples import BagFrames
from pose_io.bag_writer import STORAGES, BagWriter
from pose_io.bags import BagReader, open_bag
from pose_io.renamed_topics import add_remap_argument
from pose_io.topics import imu_topics, sensor_topics
from pose_node.command_line import add_flag, add_option, run_tool
from pose_node.many import add_many_arguments, run_many
from pose_node.plain_console import add_share, progress_bar, waiting_bar


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="pose fuse",
        description=__doc__,
        epilog="Without --sensors, all sensors of the bag are used.",
    )
    parser.add_argument("in_bag", type=Path, help="a bag, a recording, or a folder of either")
    parser.add_argument("out_bag", type=Path, help="the bag to make; of many, their folder")
    parser.add_argument("--params", type=Path, help="ROS parameter file, section 'fusion'")
    add_flag(parser, "--smooth", "also use later samples: the estimator 'smoothed'")
    add_option(parser, "--storage", "mcap", "of the new bag", choices=STORAGES)
    add_remap_argument(parser)
    add_many_arguments(parser)
    add_arguments(parser.add_argument_group("parameters of the fusion"), FusionNodeParameters)
    return parser.parse_args(arguments)


def read_parameters(arguments: argparse.Namespace, bag: BagReader) -> FusionNodeParameters:
    """Parameters from the file, then from the options; the sensors, if not named, from the bag.

    Raises:
        PoseError: If one is invalid, or the bag lacks a sensor.
    """
    values = values_from_ros_yaml(arguments.params, "fusion") if arguments.params else {}
    given = {name: getattr(arguments, name) for name in specs(FusionNodeParameters)}
    values.update({name: value for name, value in given.items() if value is not None})
    if arguments.smooth:
        if values.get("estimator", "default") not in ("default", "smoothed"):
            raise InputError(
                f"--smooth is of the default estimator, not of {values['estimator']}: "
                "leave one of them out"
            )
        values["estimator"] = "smoothed"
    parameters = from_mapping(FusionNodeParameters, values)
    wanted = parameters.sensors if "sensors" in values else ()
    return replace(parameters, sensors=checked_sensors(bag, wanted, parameters.extrinsics_file))


def make_pipeline(
    parameters: FusionNodeParameters,
    extrinsics: Extrinsics,
    alignments: SensorsToSegments,
    outlet: Callable[[str, EstimateBlock], None],
) -> PeoplePipeline:
    """The chain, with the IMUs' known alignments and the body measures of the parameters' file."""
    pipeline = PeoplePipeline(parameters, outlet, extrinsics)
    if parameters.shape_file and Path(parameters.shape_file).exists():
        pipeline.use_shape(load_body_shape(Path(parameters.shape_file), pipeline.subject.model))
    pipeline.use_sensor_to_segment(alignments)
    return pipeline


def fuse(
    bag: BagReader,
    out_bag: Path,
    parameters: FusionNodeParameters,
    *,
    storage: str = "mcap",
    console: Console | None = None,
) -> tuple[PeoplePipeline, Sequence[str]]:
    """Fuse a bag into a new one.

    Returns:
        The pipeline, for its counts; and the closing lines, about what became of the data. The new
        bag holds them, too, with the lines printed before, in ``/diagnostics``.

    Raises:
        InputError: If the bag gives no estimates, or the new one cannot be written.
    """
    console = console or Console(stderr=True)
    if out_bag.exists():
        raise InputError(f"{out_bag} exists already: name another one, or remove it first")
    name, alignments = load_alignments_if_any(parameters.imus_file, parameters.extrinsics_file)
    if parameters.imus_file and not alignments:
        raise InputError(
            f"{name} does not exist, or has no IMUs' alignments: make it with ./pose calibrate imu "
            f"BAG -o {name}, or leave --imus-file out"
        )
    said: list[str] = []

    def say(line: str) -> None:
        said.append(line)
        console.print(line, soft_wrap=True)

    prepare_visibly(parameters.estimator, body_model_of(parameters), console)
    gc.freeze()  # the garbage collector need not visit the imported modules again and again
    with BagWriter(out_bag, storage) as writer:
        with waiting_bar(console, "calibrating"):
            extrinsics = find_extrinsics(
                bag, parameters.sensors, say, parameters.extrinsics_file, imus=parameters.use_imus
            )
        if alignments:
            say(f"IMUs' alignments: from {name}, of {', '.join(alignments)}")
        with progress_bar(console, TimeRemainingColumn()) as progress:
            pipeline, output = _fuse(bag, writer, parameters, extrinsics, alignments, progress, say)
        unread = () if parameters.use_imus else imu_topics(bag)
        closing = (*bag.remarks, output.unseen, *closing_lines(pipeline, unread))
        lines = [line for line in closing if line]
        output.write_lines([*said, *lines])
    return pipeline, lines


def _fuse(
    bag: BagReader,
    writer: BagWriter,
    parameters: FusionNodeParameters,
    extrinsics: Extrinsics,
    alignments: SensorsToSegments,
    progress: Progress,
    say: Say,
) -> tuple[PeoplePipeline, EstimateWriter]:
    """The passes over a bag whose calibration is known; see :func:`fuse`."""
    before = first_pass(parameters) if imu_topics(bag) else None
    if before is not None:
        aligning = make_pipeline(before, extrinsics, alignments, lambda *_: None)
        history = AlignmentHistory()
        add_all(aligning, bag, progress, "aligning the IMUs", history)
        alignments = {**alignments, **history.initial(aligning.subject)}
        parameters = with_measured_delay(parameters, aligning.subject)
    pipeline = make_pipeline(
        parameters, extrinsics, alignments, lambda body_id, block: output.write(body_id, block)
    )
    output = EstimateWriter(writer, pipeline)
    for line in add_all(pipeline, bag, progress, "fusing"):
        say(line)
    if not pipeline.estimates:
        raise InputError(f"{bag.path} {_reason_for_no_pose(pipeline)}")
    path, shape = Path(parameters.shape_file), pipeline.subject.shape
    if parameters.shape_file and shape is not None and not path.exists():
        save_body_shape(path, pipeline.subject.model, shape, parameters.subject)
    return pipeline, output


def _reason_for_no_pose(pipeline: PeoplePipeline) -> str:
    parameters = pipeline.parameters
    if parameters.estimator == "imu" and not pipeline.imu_samples:
        return (
            "holds no IMU's orientations (imu_<segment>/data), which the estimator imu needs: "
            "use default"
        )
    if parameters.estimator == "imu" and pipeline.status == "tracking":
        unused = "; ".join(f"IMU {use}" for use in pipeline.subject.imu_uses if use.reason)
        return f"gave no pose: the cameras were needed up to its end to align the IMUs: {unused}"
    if pipeline.status.startswith("nobody is chosen"):
        return (
            f"gave no pose ({pipeline.status}): --person is first, nearest, imus, or the id by "
            "which a sensor knows the person"
        )
    needed = f": the sensors must see the whole person for {parameters.shape_duration:g} s"
    return (
        f"gave no pose in {pipeline.subject.counters['frames']} frames ({pipeline.status})"
        f"{'' if 'in metres' in pipeline.status else needed}"
    )


def add_all(
    pipeline: PeoplePipeline,
    bag: BagReader,
    progress: Progress,
    what: str,
    history: AlignmentHistory | None = None,
) -> Sequence[str]:
    """Add all samples of a bag, with a progress bar of that name; lines about those left out."""
    show, imus = add_share(progress, what), pipeline.parameters.use_imus
    frames = BagFrames(bag, show, imus=imus, clocks=pipeline.clocks)
    for each in frames:
        pipeline.add(each)
        if history is not None:
            history.note(pipeline.subject)
            if history.is_complete:
                show(1.0)
                break
    pipeline.flush()
    return frames.left_out


def run() -> int | None:
    """The tool; returns the exit status."""
    arguments = parse_arguments()
    status = run_many(arguments.in_bag, arguments.out_bag, arguments)
    if status is not None:
        return status
    console = Console(stderr=True)
    with waiting_bar(console, "reading"):
        opened = open_bag(arguments.in_bag, arguments.remap)
    with opened as bag:
        parameters = read_parameters(arguments, bag)
        unused = [sensor for sensor in sensor_topics(bag) if sensor not in parameters.sensors]
        if unused:
            console.print(
                f"sensors: {', '.join(parameters.sensors)}; not used: {', '.join(unused)}"
            )
        try:
            pipeline, lines = fuse(
                bag, arguments.out_bag, parameters, storage=arguments.storage, console=console
            )
        except PoseError:  # what was left out may be the cause
            for line in bag.remarks:
                console.print(line, soft_wrap=True)
            raise
    print(
        f"{arguments.out_bag}: {sum(pipeline.estimates.values())} estimates from "
        f"{pipeline.skeletons} skeletons and {pipeline.imu_samples} IMU samples"
    )
    for line in lines:
        print(f"  {line}")
    return None


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
