"""``./pose doctor``: what is wrong with the machine, the graph and the devices, and what to do."""

import argparse
import json
import os
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from pose_fusion.watching.devices import device_findings, kinects, serial_ports
from pose_fusion.watching.findings import Finding, Verdict, graph_findings
from pose_fusion.watching.listening import add_listen_option
from pose_fusion.watching.machine import machine_findings
from pose_node.command_line import run_tool

LISTEN_S = 4.0  # [s] diagnostics come once a second
MARKS = {
    Verdict.OK: Text("✓", "green"),
    Verdict.NOTE: Text("!", "yellow"),
    Verdict.WRONG: Text("✗", "bold red"),
}


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="pose doctor",
        description=__doc__,
        epilog="Exit code: 0 if nothing is wrong, 1 if something is.",
    )
    parser.add_argument("--json", action="store_true", help="print JSON, for programs")
    add_listen_option(
        parser, "how long to listen to the graph; 0: not at all", default_s=LISTEN_S, least_s=0.0
    )
    return parser.parse_args(arguments)


def look_at_graph(duration_s: float) -> list[Finding]:
    """Findings of the running graph, or why it cannot be seen."""
    try:
        # ROS takes a second to load, and may be what is broken.
        from pose_fusion.nodes.listener import listen

        return graph_findings(listen(duration_s))
    except Exception as error:  # whatever a broken installation raises
        reason = " ".join(str(error).split()) or type(error).__name__
        return [
            Finding(
                area="graph",
                subject="ROS",
                verdict=Verdict.WRONG,
                found=f"a node cannot start: {reason}",
                remedy="./pose build; is RMW_IMPLEMENTATION one that is installed?",
            )
        ]


def as_table(findings: Sequence[Finding]) -> Table:
    """One line a finding, its remedy below."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), show_header=False)
    for _ in range(3):
        table.add_column(overflow="fold")
    area = ""
    for finding in findings:
        if finding.area != area:
            area = finding.area
            table.add_row("", Text(area, "bold"), "")
        table.add_row(MARKS[finding.verdict], finding.subject, Text(finding.found))
        if finding.remedy:
            table.add_row("", "", Text(f"→ {finding.remedy}", "italic"))
    return table


def run() -> int:
    """The tool; its exit code."""
    options = parse_arguments()
    errors = Console(stderr=True)
    findings = list(machine_findings(Path.cwd(), os.environ))
    if options.listen > 0.0:
        with errors.status(f"listening to the graph for {options.listen:g} s"):
            findings += look_at_graph(options.listen)
    findings += device_findings(serial_ports(), kinects())
    wrong = [finding for finding in findings if finding.verdict is Verdict.WRONG]
    if options.json:
        entries = [{**vars(finding), "verdict": finding.verdict.value} for finding in findings]
        print(json.dumps({"wrong": len(wrong), "findings": entries}, indent=1))
    else:
        console = Console(highlight=False)
        console.print(as_table(findings))
        summary = f"{len(wrong)} things are wrong" if len(wrong) != 1 else "1 thing is wrong"
        console.print(f"\n{summary}" if wrong else "\nnothing is wrong")
    return 1 if wrong else 0


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
