"""``./pose bench fuzz``: mutated inputs for everything that reads what others have written."""

import argparse

from pose_bench.fuzz_targets import targets
from pose_bench.fuzzing import MAX_GROWN_MB, TargetResult, fuzz
from pose_core.errors import InputError
from pose_node.command_line import add_option

SUMMARY = "mutated files, messages and byte streams: nothing may crash, hang or eat memory"
SHARES = {"bag": 0.02, "bag's condition": 0.2}  # of the cases, for targets that are slow


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The command line's arguments."""
    add_option(parser, "--cases", 1000, "inputs of each target", "N")
    add_option(parser, "--seed", 0, "another seed: other inputs", "N")
    parser.add_argument("--only", metavar="NAME", default="", help="targets whose name contains it")


def run(options: argparse.Namespace) -> int:
    """Run; 1 if anything crashed."""
    outcomes: list[TargetResult] = []
    with targets() as every:
        chosen = [target for target in every if options.only in target.name]
        if not chosen:
            names = ", ".join(target.name for target in every)
            raise InputError(f"no target's name contains '{options.only}': there are {names}")
        for target in chosen:
            cases = max(1, round(options.cases * SHARES.get(target.name, 1.0)))
            outcome = fuzz(target, cases, options.seed)
            outcomes.append(outcome)
            print(_line(outcome), flush=True)
            for index, (what, data) in enumerate(outcome.crashes.items()):
                print(f"    {what}: {data[:80]!r}", flush=True)
                if options.output:
                    options.output.mkdir(parents=True, exist_ok=True)
                    (options.output / f"{target.name}-{index}".replace(" ", "-")).write_bytes(data)
    total, crashes = sum(o.cases for o in outcomes), sum(len(o.crashes) for o in outcomes)
    print(f"{total} cases, {crashes} kinds of crashes")
    grown = any(outcome.grown_mb > MAX_GROWN_MB for outcome in outcomes)
    return 1 if crashes or grown else 0


def _line(outcome: TargetResult) -> str:
    return (
        f"{outcome.name:20} {outcome.cases:8} cases, {outcome.refused} refused, "
        f"{outcome.kept} inputs kept for new code, slowest {outcome.slowest_s * 1e3:.0f} ms, "
        f"memory +{outcome.grown_mb:.0f} MB, {len(outcome.crashes)} crashes"
    )
