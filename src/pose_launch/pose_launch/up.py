"""``up``: starts a graph from a ROS 2 YAML launch file and stops it cleanly on Ctrl-C."""

import argparse
import asyncio
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pose_core.errors import PoseError
from pose_launch.evaluation import Graph, LaunchEvaluation
from pose_launch.locating import find_launch_file
from pose_launch.processes import Process
from pose_launch.supervising import STARTING_S, ProcessSupervisor
from pose_node.command_line import add_flag, run_tool

DEFAULT_FILE = "capture.launch.yaml"
EXIT_AT_END = "exit_at_end"  # argument and parameter: whether a node ends with its recording


def main() -> None:
    """Entry point of the executable."""
    run_tool(lambda: up(sys.argv[1:]))


def up(words: Sequence[str]) -> int:
    """Run ``up`` with these arguments; returns its exit code."""
    options = _parser().parse_intermixed_args(words)
    texts: list[str] = options.words
    files = [text for text in texts if ":=" not in text]
    if len(files) > 1:
        raise PoseError(f"found two launch files, {' and '.join(files)}: give one")
    file = find_launch_file(files[0] if files else DEFAULT_FILE)
    given = dict(text.split(":=", 1) for text in texts if ":=" in text)
    if options.show_args:
        _show_arguments(LaunchEvaluation(given, describe=True).run(file))
        return 0
    if not options.keep_running and EXIT_AT_END not in given:
        declared = LaunchEvaluation(given, describe=True).run(file).arguments
        given |= {EXIT_AT_END: "true"} if EXIT_AT_END in {a.name for a in declared} else {}
    graph = LaunchEvaluation(given).run(file)
    if options.print:
        for process in graph.processes:
            print(f"{process.name}: {process.shown()}")
        return 0
    if not graph.processes:
        raise PoseError(f"{file} starts nothing with these arguments")
    print(f"[up] starting {', '.join(process.name for process in graph.processes)}", flush=True)
    recordings = [process.name for process in graph.processes if _ends_by_itself(process)]
    ending = ", and so does the end of the recording" if recordings else ""
    print(f"[up] Ctrl-C stops all of it{ending}", flush=True)
    supervisor = ProcessSupervisor(
        graph.processes, keep_going=options.keep_going, recordings=recordings
    )
    return asyncio.run(supervisor.run())


def _ends_by_itself(process: Process) -> bool:
    """Whether a process replays a recording and ends with it."""
    values: dict[str, Any] = {}
    for source in process.parameters:
        values.update({} if isinstance(source, Path) else source)
    is_replay = values.get("source", "file") == "file" and not values.get("loop", False)
    return is_replay and values.get(EXIT_AT_END) is True


def _show_arguments(graph: Graph) -> None:
    for argument in graph.arguments:
        default = "must be given" if argument.default is None else f"default: {argument.default!r}"
        print(f"{argument.name}:=  ({default})")
        if argument.description:
            print(f"    {argument.description}")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="pose up",
        description="Start a graph from a ROS 2 YAML launch file, the same file that 'ros2 launch'"
        " takes; Ctrl-C stops it.",
        epilog="Exit code: 0 if every process ended well, 1 if one failed.",
    )
    parser.add_argument(
        "words",
        nargs="*",
        metavar="FILE | name:=value",
        help="a launch file's path, or its bare name in any package's launch folder"
        f" (default: {DEFAULT_FILE}), and arguments for it",
    )
    parser.add_argument("-s", "--show-args", action="store_true", help="list the file's arguments")
    parser.add_argument("-p", "--print", action="store_true", help="print the commands, run none")
    parser.add_argument(
        "-k",
        "--keep-going",
        action="store_true",
        help=f"let the others run if a process fails within its first {STARTING_S:g} s",
    )
    ended = "stay when all recordings that the graph replays have ended"
    add_flag(parser, "--keep-running", ended)
    return parser
