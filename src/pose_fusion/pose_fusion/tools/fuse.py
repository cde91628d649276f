"""``./pose fuse IN_BAG OUT_BAG``: what the fusion node does, on a recorded bag, at full speed."""

import argparse
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from pose_calibration.files.extrinsics_file import load_extrinsics_of
from pose_calibration.imus.section import load_mountings_if_any
from pose_calibration.session_calibration import calibrate
from pose_core.api import (
    EstimateBlock,
    Extrinsics,
    FusionParameters,
    FusionPipeline,
    body_model_of,
    extrinsics_from_map,
    load_body_shape,
    make_urdf,
    save_body_shape,
)
from pose_core.errors import InputError
from pose_core.parameters import add_arguments, from_mapping, specs, values_from_ros_yaml
from pose_core.stamps import NS_PER_S
from pose_fusion.conversions import (
    body_topics,
    to_bag_message,
    to_static_tf,
    to_string,
    type_name,
    urdf_topic,
)
from pose_fusion.estimate_bytes import EstimateBytes
from pose_fusion.tools.compiling import prepare_visibly
from pose_io.bag_samples import BagSamples, read_extrinsics
from pose_io.bag_writer import BagWriter
from pose_io.bags import BagReader, open_bag
from pose_io.clock_messages import read_clocks
from pose_io.topics import sensor_topics
from pose_node.command_line import run_tool

TF_STATIC = "/tf_static"


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="pose fuse", description=__doc__)
    parser.add_argument("in_bag", type=Path, help="a bag, or a recording of skeletons")
    parser.add_argument("out_bag", type=Path, help="the bag to make")
    parser.add_argument("--params", type=Path, help="ROS parameter file, section 'fusion'")
    parser.add_argument(
        "--smooth", action="store_true", help="look ahead too: the estimator 'smoothed'"
    )
    parser.add_argument("--storage", choices=("mcap", "sqlite3"), default="mcap")
    add_arguments(parser.add_argument_group("parameters of the fusion"), FusionParameters)
    return parser.parse_args(arguments)


def read_parameters(arguments: argparse.Namespace, bag: BagReader) -> FusionParameters:
    """Parameters from the file, then from the options; the sensors, if not named, from the bag."""
    values = values_from_ros_yaml(arguments.params, "fusion") if arguments.params else {}
    given = {name: getattr(arguments, name) for name in specs(FusionParameters)}
    values.update({name: value for name, value in given.items() if value is not None})
    if arguments.smooth:
        if values.get("estimator", "default") not in ("default", "smoothed"):
            raise InputError(
                f"--smooth is of the default estimator, not of {values['estimator']}: "
                "leave one of them out"
            )
        values["estimator"] = "smoothed"
    found = tuple(sensor_topics(bag))
    if not found:
        BagSamples(bag)  # says what is missing
    parameters = from_mapping(FusionParameters, values)
    if "sensors" not in values:
        return replace(parameters, sensors=found)
    missing = [sensor for sensor in parameters.sensors if sensor not in found]
    if missing:
        raise InputError(
            f"{arguments.in_bag} holds no skeletons of {', '.join(missing)}: "
            f"it has {', '.join(found)}"
        )
    return parameters


def find_extrinsics(bag: BagReader, parameters: FusionParameters, console: Console) -> Extrinsics:
    """Extrinsics from the file, else from the bag's transforms, else from its motion."""
    if parameters.extrinsics_file:
        return load_extrinsics_of(Path(parameters.extrinsics_file), parameters.sensors)
    placed = read_extrinsics(bag)
    if all(sensor in placed for sensor in parameters.sensors):
        clocks = read_clocks(bag)
        told = f", clocks of {', '.join(clocks)} from its clock_offsets" if clocks else ""
        console.print(f"extrinsics: from the bag's /tf_static{told}")
        extrinsics = extrinsics_from_map({sensor: placed[sensor] for sensor in parameters.sensors})
        return replace(extrinsics, clocks=clocks)
    console.print("extrinsics: none in the bag, estimating them from its motion")
    return calibrate(BagSamples(bag, parameters.person), parameters.sensors).extrinsics


class EstimateWriter:
    """Writes estimates into a bag, under the live topics' names."""

    def __init__(self, writer: BagWriter, pipeline: FusionPipeline, extrinsics: Extrinsics) -> None:
        self._writer = writer
        self._pipeline = pipeline
        self._extrinsics = extrinsics
        self._body_id = pipeline.parameters.subject
        self._bytes: EstimateBytes | None = None
        writer.add_topic(TF_STATIC, "tf2_msgs/msg/TFMessage", latched=True)
        writer.add_topic(urdf_topic(self._body_id), "std_msgs/msg/String", latched=True)
        for topic, message_type in body_topics(self._body_id).items():
            writer.add_topic(topic, type_name(message_type))

    def write(self, block: EstimateBlock) -> None:
        """Append all messages of estimates, stamped with their instants."""
        if self._bytes is None:
            self._write_latched(int(block.stamps_ns[0]))
            model, typestore = self._pipeline.model, self._writer.typestore
            self._bytes = EstimateBytes(model, self._body_id, typestore, block[0])
        latencies_s = (block.newest_ns - block.stamps_ns) / NS_PER_S
        rows = [data for _, data in self._bytes.write(block, latencies_s)]
        self._writer.write_rows(self._bytes.types, block.stamps_ns, rows)

    def _write_latched(self, stamp_ns: int) -> None:
        sensors = self._pipeline.parameters.sensors
        placed = {sensor: self._extrinsics.T_map_sensor(sensor) for sensor in sensors}
        self._append(TF_STATIC, to_static_tf(placed), stamp_ns)
        if self._pipeline.shape is not None:
            urdf = make_urdf(self._pipeline.model, self._pipeline.shape, self._body_id)
            self._append(urdf_topic(self._body_id), to_string(urdf), stamp_ns)

    def _append(self, topic: str, message: object, stamp_ns: int) -> None:
        self._writer.write(topic, to_bag_message(message, self._writer.typestore), stamp_ns)


def make_pipeline(
    parameters: FusionParameters, extrinsics: Extrinsics, console: Console
) -> FusionPipeline:
    """The chain, with what the parameters' files say."""
    pipeline = FusionPipeline(parameters, extrinsics)
    if parameters.shape_file and Path(parameters.shape_file).exists():
        pipeline.use_shape(load_body_shape(Path(parameters.shape_file), pipeline.model))
    name, mountings = load_mountings_if_any(parameters.imus_file, parameters.extrinsics_file)
    pipeline.use_mountings(mountings)
    if mountings:
        console.print(f"IMUs' mountings: from {name}, of {', '.join(mountings)}")
    return pipeline


def fuse(
    bag: BagReader,
    out_bag: Path,
    parameters: FusionParameters,
    *,
    storage: str = "mcap",
    console: Console | None = None,
) -> FusionPipeline:
    """Fuse a bag into a new one.

    Returns:
        The chain, for its counts and for what became of the IMUs.

    Raises:
        InputError: If the bag gives no estimates, or the new one cannot be written.
    """
    console = console or Console(stderr=True)
    if out_bag.exists():
        raise InputError(f"{out_bag} exists already: name another one, or remove it first")
    prepare_visibly(parameters.estimator, body_model_of(parameters).name, console)
    extrinsics = find_extrinsics(bag, parameters, console)
    pipeline = make_pipeline(parameters, extrinsics, console)
    columns = (TextColumn("fusing"), BarColumn(), TextColumn("{task.percentage:.0f} %"))
    with (
        BagWriter(out_bag, storage) as writer,
        Progress(*columns, TimeRemainingColumn(), console=console) as progress,
    ):
        output = EstimateWriter(writer, pipeline, extrinsics)
        pipeline.outlet = output.write
        task = progress.add_task("fusing", total=1.0)
        samples = BagSamples(
            bag, parameters.person, lambda share: progress.update(task, completed=share)
        )
        for sample in samples:
            pipeline.add(sample)
        pipeline.flush()
        others = samples.person_counters["other_person"]
        if others:
            whom = parameters.person or "the one whom each sensor saw first"
            console.print(f"person: {whom}; not used: {others} skeletons of others (--person ID)")
        if pipeline.counters["estimates"] == 0:
            raise InputError(
                f"{bag.path} gave no pose in {pipeline.counters['frames']} frames "
                f"({pipeline.status}): the sensors must see the whole person for "
                f"{parameters.shape_duration:g} s"
            )
        path, shape = Path(parameters.shape_file), pipeline.shape
        if parameters.shape_file and shape is not None and not path.exists():
            save_body_shape(path, pipeline.model, shape, parameters.subject)
    return pipeline


def run() -> None:
    """The tool."""
    arguments = parse_arguments()
    console = Console(stderr=True)
    with open_bag(arguments.in_bag) as bag:
        parameters = read_parameters(arguments, bag)
        unused = [sensor for sensor in sensor_topics(bag) if sensor not in parameters.sensors]
        if unused:
            console.print(
                f"sensors: {', '.join(parameters.sensors)}; not used: {', '.join(unused)}"
            )
        pipeline = fuse(
            bag, arguments.out_bag, parameters, storage=arguments.storage, console=console
        )
    counts = pipeline.counters
    print(
        f"{arguments.out_bag}: {counts['estimates']} estimates from "
        f"{counts['skeletons']} skeletons and {counts['imu_samples']} IMU samples"
    )
    for use in pipeline.imu_uses:
        print(f"  IMU {use}")


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
