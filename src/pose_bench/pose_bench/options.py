"""Options that several benchmarks have."""

import argparse
import os
from collections.abc import Collection, Sequence
from pathlib import Path

from pose_node.command_line import add_option, jobs


def add_paths(parser: argparse.ArgumentParser, name: str, metavar: str, meaning: str) -> None:
    """Declare an option that is a path and may be given again; a list, empty by default."""
    parser.add_argument(name, type=Path, action="append", default=[], metavar=metavar, help=meaning)


def add_motion_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the option ``--motion``, folders of clips; none: the bundled ones."""
    meaning = "folder of clips (.npz, .bvh), see pose_sim; may be given again (default: the "
    add_paths(parser, "--motion", "DIR", f"{meaning}bundled ones)")


def add_jobs_argument(parser: argparse.ArgumentParser, most: int | None = None) -> None:
    """Declare the option ``--jobs``: by default as many as there are cores, up to ``most``."""
    cores = os.cpu_count() or 1
    add_option(parser, "--jobs", min(most or cores, cores), "processes at once", "N", type=jobs)


def add_list(
    parser: argparse.ArgumentParser,
    name: str,
    default: Sequence[str] | Sequence[float],
    meaning: str,
    metavar: str | None = None,
    choices: Collection[str] | None = None,
) -> None:
    """Declare an option of one value or more, of the type of the defaults, which its help shows."""
    text = f"{meaning} (default: {' '.join(map(str, default))})"
    kind = type(default[0])
    parser.add_argument(
        name, nargs="+", type=kind, default=default, choices=choices, metavar=metavar, help=text
    )
