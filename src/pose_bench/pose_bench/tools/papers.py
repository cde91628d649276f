"""``./pose bench papers``: the papers' own tables beside what their methods give here."""

import argparse

from rich.console import Console

from pose_bench.papers.li2020 import MOTIONS, motion_tables
from pose_bench.papers.zhang2015 import limb_table
from pose_bench.tools.showing import publish

SUMMARY = "li2020's tables 1 to 4 and zhang2015's limbs, as printed and as here"
LEVELS = ("typical", "hard")  # of the virtual Kinects' errors; figures are means
SEEDS = (101, 102)  # that no parameter was tuned on


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """There are none."""


def run(arguments: argparse.Namespace) -> int:
    """Repeat the experiments and print the tables."""
    tables = []
    console = Console(stderr=True)
    for motion in MOTIONS:
        with console.status(f"li2020: {motion.title}"):
            tables += motion_tables(motion, LEVELS, SEEDS)
    with console.status("zhang2015: attitudes of the arms"):
        tables.append(limb_table(SEEDS))
    publish(tables, "The papers' experiments", arguments.output, "papers.md")
    return 0
