"""``./pose bench prediction``: what ``output_rate`` is worth, against the truth of now."""

import argparse
from pathlib import Path

from rich.console import Console

from pose_bench.prediction import prediction_errors
from pose_bench.sessions import SessionSpec, bench_session
from pose_bench.tables import TextTable, number
from pose_bench.tools.showing import document, output_folder, show

SUMMARY = "the pose predicted to now against the last output, both against the truth of now"
SEED = 101  # that no parameter was tuned on


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "--choreographies", nargs="+", default=["leg_lift_march", "kicks", "dance"], metavar="NAME"
    )
    parser.add_argument(
        "--duration", type=float, default=30.0, metavar="S", help="of each session [s] (30)"
    )
    parser.add_argument("--cache", type=Path, metavar="DIR", help="keeps the IMUs' orientations")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for prediction.md")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    table = TextTable(
        title="Error against the truth of now [°], mean over the angles",
        header=["", "last output", "predicted", "ratio", "its stddev", "predicted stddev"],
        note="Synthetic subject, asked every 10 ms, nothing shifted in time: without IMUs most of "
        "the error is the trackers' own delay. Standard deviations as published, medians [°].",
    )
    for name in arguments.choreographies:
        spec = SessionSpec(
            choreography=name, level="typical", seed=SEED, duration_s=arguments.duration
        )
        with Console(stderr=True).status(f"predicting {name}"):
            session = bench_session(spec, cache=arguments.cache)
            for use_imus in (False, True):
                told = prediction_errors(session, use_imus=use_imus)
                label = f"{name}, two Kinects{', nine IMUs' if use_imus else ''}"
                values = (told.held_deg, told.predicted_deg, told.predicted_deg / told.held_deg)
                stddevs = (told.held_stddev_deg, told.predicted_stddev_deg)
                table.rows.append([label, *(number(each, 2) for each in (*values, *stddevs))])
    show([table])
    if arguments.output is not None:
        with output_folder(arguments.output) as folder:
            (folder / "prediction.md").write_text(document("Prediction", [table]))
    return 0
