"""``./pose bench stream``: quality of ``joint_states`` as a robot's command."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from rich.console import Console

from pose_bench.captured import true_extrinsics
from pose_bench.captured_suite import captured_specs
from pose_bench.one_camera import CAMERA, LEVEL_MOUNTING, view_of_stream
from pose_bench.options import add_motion_argument, add_paths
from pose_bench.tools.showing import publish
from pose_calibration.session_calibration import calibrate
from pose_core.api import (
    ROOT_DOF,
    Extrinsics,
    ImuBlock,
    ImuSample,
    Pipeline,
    PipelineParameters,
    PoseError,
    SkeletonSample,
    extrinsics_from_map,
)
from pose_core.errors import InputError
from pose_evaluation.stream_quality import AngleStream, StreamQuality, measure_stream, stream_of
from pose_evaluation.table import UNKNOWN, Row, Table, number, text_row
from pose_io.bag_samples import read_estimates
from pose_io.bags import BagReader, open_bag
from pose_io.recordings.formats import read_recording
from pose_io.robot_motion import read_joint_motion
from pose_io.samples import read_samples
from pose_node.command_line import add_option
from pose_sim.captured.session import make_captured_session

SUMMARY = "whether a robot could follow joint_states: limits, steps, rate, start"
SEED = 101
COLUMNS: dict[str, Callable[[StreamQuality], str]] = {
    "messages": lambda q: str(q.messages),
    "outside limits": lambda q: f"{100.0 * q.outside / q.messages:.1f} %",
    "steps > 3 σ": lambda q: str(q.steps_beyond_stddev),
    "largest step [°]": lambda q: number(q.largest_step_deg, 1),
    "largest move [°]": lambda q: number(q.largest_move_deg, 1),
    "step after silence [°]": lambda q: number(q.step_after_silence_deg, 1),
    "stamps ahead, back or again": lambda q: str(q.ahead + q.backwards + q.repeated),
    "rate [Hz]": lambda q: number(q.rate, 1),
    "chatter at start": lambda q: number(q.start_chatter, 1),
}
NOTE = (
    "Steps are what an angle moves from one message to the next beyond what the published "
    "velocities say; after a silence of more than 0.1 s, all that it moves. Chatter: RMS of the "
    "second difference in the first two seconds, or in those after a silence, to the median of the "
    "others. Captured people before simulated sensors; recordings of one camera as they are, or of "
    "two, calibrated from their own motion; bags as they were published."
)


def published_stream(path: Path) -> AngleStream:
    """The person's stream of joint angles in a recorded bag, with the limits of its ``urdf``.

    Raises:
        InputError: If the bag lacks the person's joint states, estimates or tree.
    """
    body = "humans/bodies/subject"
    with open_bag(path) as bag:
        motion = read_joint_motion(bag, f"{body}/joint_states")
        if motion is None or len(motion.stamps_ns) < 2:
            raise InputError(f"{path} holds no /{body}/joint_states: record what the fusion sends")
        estimates = read_estimates(bag, "subject")
        limits = _limits(bag, f"/{body}/urdf")
    angles = estimates.position_stddev[:, ROOT_DOF:]
    stddev = dict(zip(estimates.stamps_ns.tolist(), angles, strict=True))
    unknown = np.full(len(motion.joints), np.nan)
    return AngleStream(
        stamps_ns=motion.stamps_ns,
        arrivals_ns=motion.recorded_ns,
        position=motion.position,
        velocity=motion.velocity,
        stddev=np.array([stddev.get(stamp, unknown) for stamp in motion.stamps_ns.tolist()]),
        limits=np.array([limits[name] for name in motion.joints]),
    )


def _limits(bag: BagReader, topic: str) -> dict[str, tuple[float, float]]:
    """Lower and upper limit [rad] of each joint in the last URDF."""
    texts = [bag.deserialize(message).data for message in bag.messages([topic])]
    if not texts:
        raise InputError(f"the bag has no {topic}: record it too")
    joints = ElementTree.fromstring(texts[-1]).iter("joint")
    found = {joint.get("name", ""): joint.find("limit") for joint in joints}
    return {
        name: (float(limit.get("lower", "-inf")), float(limit.get("upper", "inf")))
        for name, limit in found.items()
        if limit is not None
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_motion_argument(parser)
    alone = "a recording of one person; each camera's stream is fused alone, then all together"
    add_paths(parser, "--recording", "FILE", alone)
    live = "a bag that was recorded live; its joint_states are judged as they were heard"
    add_paths(parser, "--bag", "BAG", live)
    add_option(parser, "--sessions", 4, "captured ones of each folder", "N")
    add_option(parser, "--output-rate", 100.0, "of the joint states", "HZ")
    add_option(parser, "--seed", SEED, "of everything random", "N")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print; 1 if a stream does not meet a requirement."""
    rows: list[Row] = []
    broken: list[str] = []
    with Console(stderr=True).status("fusing") as status:
        for name, quality in measured(arguments):
            status.update(f"fused {name}")
            if quality is None:
                rows.append(text_row(name, "0", *[UNKNOWN] * (len(COLUMNS) - 1)))
                broken.append(f"{name}: nothing published")
            else:
                rows.append(text_row(name, *(cell(quality) for cell in COLUMNS.values())))
                broken += [f"{name}: {what}" for what in quality.broken(arguments.output_rate)]
    table = Table(
        caption="joint_states", head="stream", columns=list(COLUMNS), rows=rows, note=NOTE
    )
    publish([table], SUMMARY, arguments.output, "stream.md")
    for line in broken:
        print(f"not met  {line}")
    return int(bool(broken))


def measured(arguments: argparse.Namespace) -> Iterator[tuple[str, StreamQuality | None]]:
    """Name and figures of each stream, None for an empty one."""
    rate = arguments.output_rate
    has_others = arguments.recording or arguments.bag
    folders: Sequence[Path | None] = arguments.motion or ([] if has_others else [None])
    for folder in folders:
        specs = captured_specs(folder, held_out=True, seed=arguments.seed)
        for spec in specs[: arguments.sessions]:
            session = make_captured_session(spec)
            extrinsics = true_extrinsics(session)
            for imus in (False, True):
                name = spec.name + (", nine IMUs" if imus else "")
                yield name, quality_of(session.samples(imus=imus), extrinsics, rate, imus)
    for path in arguments.recording:
        streams = read_recording(path).streams
        for stream in streams:
            extrinsics = extrinsics_from_map({CAMERA: LEVEL_MOUNTING})
            samples = view_of_stream(stream).samples
            yield f"{path.name} {stream.name}", quality_of(samples, extrinsics, rate, False)
        if len(streams) > 1:
            recorded, name = read_samples(path), f"{path.name}, all"
            try:
                extrinsics = calibrate(recorded.samples, recorded.sensors).extrinsics
            except PoseError as error:
                print(f"left out {name}: {error}")
                continue
            yield name, quality_of(recorded.samples, extrinsics, rate, False)
    for path in arguments.bag:
        yield f"{path.name}, live", measure_stream(published_stream(path))


def quality_of(
    samples: Sequence[SkeletonSample | ImuSample | ImuBlock],
    extrinsics: Extrinsics,
    output_rate: float,
    use_imus: bool,
) -> StreamQuality | None:
    """Fuse samples by the default estimator and evaluate the output; None without output."""
    parameters = PipelineParameters(
        sensors=extrinsics.sensors, use_imus=use_imus, output_rate=output_rate
    )
    pipeline = Pipeline(parameters, extrinsics)
    estimates = [estimate for sample in samples for estimate in pipeline.add(sample)]
    estimates += pipeline.flush()
    return measure_stream(stream_of(estimates, pipeline.model)) if len(estimates) > 1 else None
