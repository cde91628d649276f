"""Report of the demo: tables, counts, and the page of ``./pose report``."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from pose_core.api import SkeletonSeries
from pose_evaluation import tables
from pose_evaluation.agreement import measure_agreement, measure_stability
from pose_evaluation.methods import FUSED, MEAN, methods_of_bag
from pose_evaluation.scores import evaluate
from pose_evaluation.table import Table
from pose_fusion.launched_graph import GraphError
from pose_fusion.tools.demo_run import DemoRun
from pose_fusion.watching.stages import reported_stages
from pose_io.bag_samples import read_body_series, read_extrinsics
from pose_io.bags import BagReader, open_bag
from pose_io.names import TRUTH_NAMESPACE, skeletons_topic
from pose_io.references.reference import reference_of_skeleton
from pose_io.topics import body_topic
from pose_node.child_process import executable, run_to_end


def report_synthetic(run: DemoRun, truth: Path, console: Console) -> None:
    """Compare a synthetic subject's run with the truth: a table, and the report's page.

    Raises:
        GraphError: If no fused skeletons came out.
    """
    with open_bag(run.bag) as bag, open_bag(truth) as true_bag:
        methods = _methods(bag, run)
        reference = read_body_series(true_bag, namespace=TRUTH_NAMESPACE)
        truth_named = reference_of_skeleton("the simulated truth", reference, synthetic=True)
        table = tables.evaluation_table(evaluate(methods, truth_named))
        _print(run, bag, methods, [table], console)
    _write_page(run, [*methods], console, "--reference", truth)


def report_recording(run: DemoRun, console: Console) -> None:
    """Report a run without a reference: agreement of the views, bones, and the report's page.

    Raises:
        GraphError: If no fused skeletons came out.
    """
    with open_bag(run.bag) as bag:
        methods = _methods(bag, run)
        views = measure_agreement(methods, read_extrinsics(bag))
        stability = {name: measure_stability(series) for name, series in methods.items()}
        found = [*tables.view_tables(views), tables.stability_table(stability)]
        _print(run, bag, methods, found, console)
    _write_page(run, [*methods], console)


def _print(
    run: DemoRun,
    bag: BagReader,
    methods: Mapping[str, SkeletonSeries],
    found: Sequence[Table],
    console: Console,
) -> None:
    for table in found:
        console.print()
        console.print(table.terminal())
    _print_counts(bag, run, methods, console)
    _line(console, "bag", str(run.bag))


def _write_page(
    run: DemoRun, methods: Sequence[str], console: Console, *reference: str | Path
) -> None:
    """Write the page of ``./pose report`` about the methods that the bag itself holds."""
    folder = run.folder / "report"
    words = [run.bag, *reference, "-o", folder, "--methods", *methods]
    run_to_end([executable("pose_view", "report"), *words])
    _line(console, "report", f"{folder / 'report.html'} (open it in a browser)")


def _methods(bag: BagReader, run: DemoRun) -> dict[str, SkeletonSeries]:
    methods = methods_of_bag(bag)
    if FUSED not in methods or len(methods[FUSED]) == 0:
        said = [f"{name.lstrip('/')}: {n.message}" for name, n in run.nodes.items() if n.level]
        why = "; ".join(said) or "no node reports a reason"
        raise GraphError(f"no joint states came out: {why} (what went in is in {run.bag})")
    return methods


def _print_counts(
    bag: BagReader, run: DemoRun, methods: Mapping[str, SkeletonSeries], console: Console
) -> None:
    """Print frames in and out, losses and latency."""
    sensors = {name: each for name, each in methods.items() if name not in (MEAN, FUSED)}
    console.print()
    for name in sensors:
        _line(console, f"kinect_{name}", _sensor_text(bag, run, name))
    imus = [topic for topic in bag.topics if topic.endswith("/data") and "/imu_" in topic]
    if imus:
        count = sum(bag.topics[topic].count for topic in imus)
        _line(console, "IMUs", f"{len(imus)} segments, {count} orientations recorded{_losses(run)}")
        _line(console, "", _alignment(run, len(imus)))
    topic = body_topic(bag, "joint_states")
    first_s = min(int(each.stamps_ns[0]) for each in sensors.values() if len(each))
    after_s = (int(methods[FUSED].stamps_ns[0]) - first_s) * 1e-9
    count = bag.topics[topic].count if topic else 0
    first = f"{count} out, the first {after_s:.1f} s after the first frame"
    _line(console, "joint states", f"{first} (extrinsics and bone lengths come first)")
    if stages := _stages(run):
        _line(console, "latency", f"[ms] {stages} (last ten seconds)")


def _stages(run: DemoRun) -> str:
    """Latency of the reference sensor's frames up to each stage."""
    return "; ".join(
        f"{stage.replace('_', ' ')} {text}"
        for path, node in run.nodes.items()
        if path.endswith("/fusion")
        for stage, text in reported_stages(node.values).items()
    )


def _sensor_text(bag: BagReader, run: DemoRun, name: str) -> str:
    topic = next(topic for topic in bag.topics if topic.endswith(skeletons_topic(name)))
    recorded = bag.topics[topic].count
    bridges = [node for path, node in run.nodes.items() if path.endswith(f"kinect_{name}")]
    # The bridge's last report may be a second old: more frames may be recorded.
    lost = max([0, *(node.count("frames_published") - recorded for node in bridges)])
    return f"{recorded + lost} frames in, {lost or 'none'} lost on the way to the bag"


def _alignment(run: DemoRun, imus: int) -> str:
    """Number of aligned IMUs."""
    reports = [node.values.get("imus_aligned", "") for node in run.nodes.values()]
    aligned = [name for text in reports for name in text.split(", ") if name not in ("", "none")]
    text = f"{len(aligned)} of {imus} aligned with their segments"
    if not aligned:
        text += ": the result uses only the cameras; move and turn the segments in their view"
    return text


def _losses(run: DemoRun) -> str:
    """Lost and corrupted frames counted by the IMUs' bridge."""
    lost = garbled = 0
    for node in run.nodes.values():
        lost += sum(node.count(key) for key in node.values if key.endswith(".lost"))
        garbled += node.count("crc_errors")
    return f"; on the air {lost} frames were lost and {garbled} garbled" if lost or garbled else ""


def _line(console: Console, label: str, text: str) -> None:
    console.print(Text(f"{label:<14}{text}"), soft_wrap=True)
