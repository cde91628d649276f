"""``./pose bench faults``: faults injected into the live graph, one table."""

import argparse
import tempfile
from pathlib import Path

from pose_bench.faults.catalogue import chosen
from pose_bench.faults.judging import FaultResult
from pose_bench.faults.table import fault_table, row
from pose_bench.tools.fault_sessions import run_faults
from pose_bench.tools.showing import document, show

SUMMARY = "inject faults into the live graph: steps, errors, stamps, warnings, recovery"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The command line's arguments."""
    parser.add_argument(
        "--only", metavar="NAME", default="", help="faults whose name contains this"
    )
    parser.add_argument(
        "--tenth", metavar="K", type=int, help="every tenth fault, from the K-th on"
    )
    parser.add_argument("--list", action="store_true", help="the names of all faults")


def run(options: argparse.Namespace) -> int:
    """Run; 1 if a bound is broken."""
    faults = chosen(options.only, options.tenth)
    if options.list:
        print("\n".join(fault.name for fault in faults))
        return 0
    results: list[FaultResult] = []
    with tempfile.TemporaryDirectory(prefix="pose-faults-") as scratch:
        folder = options.output or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for result in run_faults(faults, folder, lambda text: print(text, flush=True)):
            results.append(result)
            print("  " + " | ".join(row(result)), flush=True)
            if result.said:
                print(f"    said: {result.said}", flush=True)
            if options.output:  # after each one, since all of them take hours
                text = document("Reliability", [fault_table(results)])
                (folder / "reliability.md").write_text(text)
    show([fault_table(results)])
    broken = [result.fault.name for result in results if result.broken]
    if broken:
        print(f"{len(broken)} of {len(faults)} faults break a bound: {', '.join(broken)}")
    return 1 if broken else 0
