"""Print the virtual Kinects' errors beside the published ones of real Kinects."""

import argparse
import sys

from pose_node.command_line import run_tool
from pose_sim.noise_comparison import compare
from pose_sim.session import NOISE_PRESETS


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="compare_noise",
        description="Measure the virtual Kinects on synthetic sessions and print their errors "
        "beside those published of real Kinects, as a Markdown table.",
    )
    parser.add_argument(
        "--noise",
        nargs="+",
        default=["typical", "hard"],
        choices=NOISE_PRESETS,
        help="presets to measure (default: typical hard)",
    )
    parser.add_argument(
        "--seeds", nargs="+", type=int, default=[1, 2, 3], help="sessions (default: 1 2 3)"
    )
    return parser


def run() -> None:
    """Parse the command line, evaluate the presets and print the table."""
    arguments = make_parser().parse_args()
    columns = []
    for preset in arguments.noise:
        print(f"measuring {preset} on {len(arguments.seeds)} seeds ...", file=sys.stderr)
        columns.append(compare(preset, arguments.seeds))
    print("| quantity | published | " + " | ".join(f"`{name}`" for name in arguments.noise) + " |")
    print("|---" * (2 + len(columns)) + "|")
    for rows in zip(*columns, strict=True):
        cells = [rows[0].quantity, rows[0].published, *(row.simulated for row in rows)]
        print("| " + " | ".join(cells) + " |")


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
