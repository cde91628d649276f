"""Check the machine, the running graph and the devices, or a bag, and say what to do."""

import argparse
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from pose_core.errors import InputError
from pose_fusion.watching.devices import device_findings, kinects, serial_ports
from pose_fusion.watching.findings import Finding, Verdict, graph_findings, wrong
from pose_fusion.watching.machine import machine_findings
from pose_io.bag_repair import Condition, examine, mcap_file, repair
from pose_io.bags import open_bag
from pose_node.command_line import add_option, add_path, number_within, run_tool
from pose_node.plain_console import add_share, plain_console, progress_bar

LISTEN_S, MAX_DURATION_S = 4.0, 600.0  # [s] diagnostics are published once per second
MARKS = {
    Verdict.OK: Text("✓", "green"),
    Verdict.NOTE: Text("!", "yellow"),
    Verdict.WRONG: Text("✗", "bold red"),
}


def doctor_bag(bag: Path, output: Path | None) -> int:
    """Report the faults of a bag, and write a repaired bag if ``output`` is given.

    Args:
        bag: A rosbag2 folder or an ``.mcap`` file, which is not changed.
        output: The folder to create.

    Returns:
        The exit code: 0 if the bag is intact, or has been repaired.

    Raises:
        InputError: If there is no such bag, it has no intact messages, or the output cannot be
            written.
    """
    if not bag.exists():
        raise InputError(f"found no bag at {bag}: expected a rosbag2 folder or an .mcap file")
    file = mcap_file(bag)
    condition = examine(file)
    lacks_metadata = bag.is_dir() and not (bag / "metadata.yaml").exists()
    for line in findings(file, condition, lacks_metadata):
        print(line)
    is_whole = condition.is_whole and not lacks_metadata
    if output is None:
        if is_whole:
            _describe(bag)
        else:
            print(f"→ ./pose doctor {bag} --output REPAIRED writes the intact part as a new bag")
        return 0 if is_whole else 1
    with progress_bar(Console(stderr=True)) as progress:
        repair(file, condition, output, add_share(progress, "mending"))
    _describe(output)
    return 0


def findings(file: Path, condition: Condition, lacks_metadata: bool) -> list[str]:
    """Faults of a bag, one line each."""
    lines = []
    if not condition.ends:
        lost = condition.size - condition.whole
        lines.append(
            f"{file} is cut short or damaged: {condition.whole} of its {condition.size} bytes are"
            f" whole, the last {lost} are not ({condition.problem})"
        )
    elif not condition.has_index:
        lines.append(f"{file} has no index: its recording was cut off; every byte of it is whole")
    if lacks_metadata:
        lines.append(f"{file.parent} has no metadata.yaml: its recording was cut off")
    return lines


def _describe(path: Path) -> None:
    with open_bag(path) as bag:
        print(
            f"{path}: {len(bag.topics)} topics, {bag.message_count} messages,"
            f" {bag.duration_s:.1f} s, whole"
        )


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="pose doctor",
        description=__doc__,
        epilog="Exit code: 0 if nothing is wrong, 1 if something is.",
    )
    parser.add_argument(
        "bag", nargs="?", type=Path, metavar="BAG", help="check this recording instead"
    )
    intact = "write the intact part of BAG as a new bag; BAG itself is never changed"
    add_path(parser, "--output", "REPAIRED", intact)
    parser.add_argument("--json", action="store_true", help="print JSON, for programs")
    meaning = "how long to listen to the graph [s]; 0: not at all"
    within = number_within(0.0, MAX_DURATION_S, "s")
    add_option(parser, "--listen", LISTEN_S, meaning, "S", type=within)
    return parser.parse_args(arguments)


def look_at_graph(duration_s: float) -> list[Finding]:
    """Findings of the running graph, or the reason why there is no access to it."""
    try:
        # Imported here: ROS takes a second to load, and its installation may be broken.
        from pose_fusion.nodes.listener import listen

        return graph_findings(listen(duration_s))
    except Exception as error:  # a broken installation may raise any exception
        found = f"a node cannot start: {' '.join(str(error).split()) or type(error).__name__}"
        return [wrong("ROS", found, "./pose build; is RMW_IMPLEMENTATION one that is installed?")]


def as_table(findings: Mapping[str, Sequence[Finding]]) -> Table:
    """One line per finding, by area, with its remedy below."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), show_header=False)
    for _ in range(3):
        table.add_column(overflow="fold")
    for area, found in findings.items():
        table.add_row("", Text(area, "bold"), "")
        for finding in found:
            table.add_row(MARKS[finding.verdict], finding.subject, Text(finding.found))
            if finding.remedy:
                table.add_row("", "", Text(f"→ {finding.remedy}", "italic"))
    return table


def run() -> int:
    """Run the tool; returns its exit code."""
    options = parse_arguments()
    if options.bag is not None:
        return doctor_bag(options.bag, options.output)
    if options.output is not None:
        raise InputError("--output is of no use without BAG: name the recording to mend")
    errors = Console(stderr=True)
    findings = {"machine": list(machine_findings(Path.cwd(), os.environ))}
    if options.listen > 0.0:
        with errors.status(f"listening to the graph for {options.listen:g} s"):
            findings["graph"] = look_at_graph(options.listen)
    findings["devices"] = list(device_findings(serial_ports(), kinects()))
    faults = sum(each.verdict is Verdict.WRONG for found in findings.values() for each in found)
    if options.json:
        entries = [
            {"area": area, **vars(each), "verdict": each.verdict.value}
            for area, found in findings.items()
            for each in found
        ]
        print(json.dumps({"wrong": faults, "findings": entries}, indent=1))
    else:
        console = plain_console()
        console.print(as_table(findings))
        summary = f"{faults} things are wrong" if faults != 1 else "1 thing is wrong"
        console.print(f"\n{summary}" if faults else "\nnothing is wrong")
    return 1 if faults else 0


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
