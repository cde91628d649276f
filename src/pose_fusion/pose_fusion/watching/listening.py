"""The option for the time that a tool listens to the graph before it reports."""

import argparse

LONGEST_S = 600.0  # [s]


def add_listen_option(
    parser: argparse.ArgumentParser, meaning: str, *, default_s: float, least_s: float
) -> None:
    """Add ``--listen``.

    Args:
        parser: To which.
        meaning: What the help says of it.
        default_s: How long to listen by default [s].
        least_s: The least that makes sense [s].
    """

    def duration(text: str) -> float:
        value = float(text)
        if not least_s <= value <= LONGEST_S:
            raise argparse.ArgumentTypeError(f"{text} s is outside [{least_s:g}, {LONGEST_S:g}]")
        return value

    parser.add_argument(
        "--listen",
        type=duration,
        default=default_s,
        metavar="S",
        help=f"{meaning} [s] (default: {default_s:g})",
    )
