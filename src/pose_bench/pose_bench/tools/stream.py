"""``./pose bench stream``: whether a robot could follow ``joint_states``."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console

from pose_bench.captured import true_extrinsics
from pose_bench.captured_suite import captured_specs
from pose_bench.one_camera import CAMERA, LEVEL_MOUNTING, view_of_stream
from pose_bench.tables import TextTable, number
from pose_bench.tools.showing import document, output_folder, show
from pose_core.api import (
    Extrinsics,
    FusionParameters,
    FusionPipeline,
    ImuSample,
    SkeletonSample,
    extrinsics_from_map,
)
from pose_evaluation.stream_quality import StreamQuality, measure_stream, stream_of
from pose_io.recordings.formats import read_recording
from pose_sim.captured.session import make_captured_session

SUMMARY = "whether a robot could follow joint_states: limits, steps, rate, start"
SEED = 101
HEADER = (
    "stream",
    "messages",
    "outside limits",
    "steps > 10°",
    "steps > 3 σ",
    "largest step [°]",
    "largest move [°]",
    "rate [Hz]",
    "interval p1–p99 [ms]",
    "chatter at start",
)
NOTE = (
    "Steps are what an angle moves from one message to the next beyond what the published "
    "velocities say. Chatter: RMS of the second difference in the first two seconds to the median "
    "of later ones. Captured people before simulated sensors; recordings of one camera as they are."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "--motion", type=Path, action="append", metavar="DIR", help="folder of clips, see pose_sim"
    )
    parser.add_argument(
        "--recording",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="a recording of one person; each camera's stream is fused alone",
    )
    parser.add_argument("--sessions", type=int, default=4, help="captured ones of each folder (4)")
    parser.add_argument("--output-rate", type=float, default=100.0, metavar="HZ")
    parser.add_argument("--seed", type=int, default=SEED, help="of everything random")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for stream.md")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    table = TextTable(title="joint_states", header=HEADER, note=NOTE)
    with Console(stderr=True).status("fusing") as status:
        for name, quality in measured(arguments):
            status.update(f"fused {name}")
            table.rows.append(row_of(name, quality))
    show([table])
    if arguments.output is not None:
        with output_folder(arguments.output) as folder:
            (folder / "stream.md").write_text(document(SUMMARY, [table]))
    return 0


def measured(arguments: argparse.Namespace) -> Iterator[tuple[str, StreamQuality]]:
    """Each stream's name and figures."""
    rate = arguments.output_rate
    folders: Sequence[Path | None] = arguments.motion or ([] if arguments.recording else [None])
    for folder in folders:
        for spec in captured_specs(folder, judged=True, seed=arguments.seed)[: arguments.sessions]:
            session = make_captured_session(spec)
            extrinsics = true_extrinsics(session)
            for imus in (False, True):
                name = spec.name + (", nine IMUs" if imus else "")
                yield name, quality_of(session.samples(imus=imus), extrinsics, rate, imus)
    for path in arguments.recording:
        for stream in read_recording(path).streams:
            extrinsics = extrinsics_from_map({CAMERA: LEVEL_MOUNTING})
            samples = view_of_stream(stream).samples
            yield f"{path.name} {stream.name}", quality_of(samples, extrinsics, rate, False)


def quality_of(
    samples: Sequence[SkeletonSample | ImuSample],
    extrinsics: Extrinsics,
    output_rate: float,
    use_imus: bool,
) -> StreamQuality:
    """Fuse samples by the default estimator and judge what is published."""
    parameters = FusionParameters(
        sensors=extrinsics.sensors, use_imus=use_imus, output_rate=output_rate
    )
    pipeline = FusionPipeline(parameters, extrinsics)
    estimates = [estimate for sample in samples for estimate in pipeline.add(sample)]
    return measure_stream(stream_of([*estimates, *pipeline.flush()], pipeline.model))


def row_of(name: str, quality: StreamQuality) -> list[str]:
    """A row of the table."""
    low, _, high = quality.interval_ms
    return [
        name,
        str(quality.messages),
        f"{100.0 * quality.outside / quality.messages:.1f} %",
        str(quality.steps),
        str(quality.steps_beyond_stddev),
        number(quality.largest_step_deg, 1),
        number(quality.largest_move_deg, 1),
        number(quality.rate, 1),
        f"{low:.1f}–{high:.1f}",
        number(quality.start_chatter, 1),
    ]
