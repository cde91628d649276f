"""``./pose bench steps``: random steps of the default filter; its covariance stays valid."""

import argparse

from pose_bench.random_steps import Checks, random_steps
from pose_node.command_line import add_option

MAX_ASYMMETRY = 1e-12  # [-] of the correlations
SUMMARY = "random steps of the default filter: the covariance stays symmetric, positive definite"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_option(parser, "--count", 1_000_000, "of steps", "N")
    add_option(parser, "--seed", 0, "another seed: other steps", "N")


def run(arguments: argparse.Namespace) -> int:
    """Run and print; 1 if the covariance was ever invalid."""
    checks = Checks()
    for checks in random_steps(arguments.count, arguments.seed):
        print(line(checks), flush=True)
    is_valid = checks.asymmetry <= MAX_ASYMMETRY and not checks.indefinite
    return 0 if is_valid and not checks.infinite else 1


def line(checks: Checks) -> str:
    """The results so far, in one line."""
    return (
        f"{checks.steps} steps, {checks.infinite} not finite; {checks.factorised} factorised, "
        f"{checks.indefinite} indefinite; correlations: asymmetry {checks.asymmetry:.1e}, smallest "
        f"eigenvalue {checks.least:.1e}"
    )
