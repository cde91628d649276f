"""``--remap OLD:=NEW``: topics of a bag under the names that the fusion knows."""

import argparse
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from pose_core.errors import InputError

Renaming = tuple[str, str]  # old and new name of a topic


def add_remap_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the option ``--remap`` of a tool that reads a bag."""
    parser.add_argument(
        "--remap",
        type=_renaming,
        nargs="+",
        action="extend",
        default=[],
        metavar="OLD:=NEW",
        help="read a topic of the bag under another name, "
        "for example /imu/thigh_l:=/imu_left_thigh/data",
    )


def _renaming(text: str) -> Renaming:
    """The old and the new name of ``OLD:=NEW``, the new one absolute."""
    old, _, new = (part.strip() for part in text.partition(":="))
    if not old or not new:
        raise argparse.ArgumentTypeError(f"'{text}': expected OLD:=NEW, two names of topics")
    return old, f"/{new.lstrip('/')}"


def checked_names(
    renamings: Iterable[Renaming], topics: Collection[str], source: Path
) -> Mapping[str, str]:
    """New names of some of the topics of a bag; an old one may lack the slash at its beginning.

    Raises:
        InputError: If a topic does not exist, or two would have the same name.
    """
    names: dict[str, str] = {}
    for old, new in renamings:
        found = old if old in topics else f"/{old}"
        if found not in topics:
            raise InputError(
                f"--remap {old}:={new}: {source} has no topic {old}; it has "
                f"{', '.join(sorted(topics))}"
            )
        if found in names:
            raise InputError(f"--remap: {found} is named twice, as {names[found]} and {new}")
        names[found] = new
    name, count = Counter(names.get(topic, topic) for topic in topics).most_common(1)[0]
    if count > 1:
        raise InputError(f"--remap: {count} topics of {source} would be {name}: expected one")
    return names
