"""``./pose policy``: the SROS 2 policy file of the graph that runs now."""

import argparse
import time
from pathlib import Path

import rclpy
from rclpy.node import Node

from pose_core.errors import InputError
from pose_fusion.watching.policy import NodeUse, policy_xml
from pose_node.command_line import run_tool

LOOKED_S = 3.0  # [s] for which nodes are looked for


def graph_of(node: Node) -> dict[tuple[str, str], NodeUse]:
    """What the other nodes of the graph use, by namespace and name."""
    found = {}
    for name, namespace in set(node.get_node_names_and_namespaces()):
        if name == node.get_name() or name.startswith("_"):
            continue
        found[namespace, name] = NodeUse(
            publishes=_names(node.get_publisher_names_and_types_by_node(name, namespace)),
            subscribes=_names(node.get_subscriber_names_and_types_by_node(name, namespace)),
            replies=_names(node.get_service_names_and_types_by_node(name, namespace)),
            requests=_names(node.get_client_names_and_types_by_node(name, namespace)),
        )
    return found


def _names(found: list[tuple[str, list[str]]]) -> tuple[str, ...]:
    return tuple(name for name, _ in found)


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="pose policy",
        description="Write the SROS 2 policy of the graph that runs now: each node may do what it"
        " does, nothing else.",
    )
    parser.add_argument("-o", "--output", type=Path, help="the file; printed if left out")
    parser.add_argument("--enclave", default="/pose", help="that all nodes run in (/pose)")
    return parser


def run(arguments: list[str] | None = None) -> None:
    """The tool."""
    options = make_parser().parse_args(arguments)
    rclpy.init(args=[])
    node = Node("policy_writer", enable_rosout=False)
    try:
        time.sleep(LOOKED_S)
        nodes = graph_of(node)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    if not nodes:
        raise InputError("no node runs: start the graph first, for example with ./pose up")
    text = policy_xml(nodes, options.enclave) + "\n"
    if options.output is None:
        print(text, end="")
        return
    try:
        options.output.write_text(text)
    except OSError as error:
        raise InputError(f"cannot write {options.output}: {error.strerror}") from error
    print(f"{options.output}: {len(nodes)} nodes")


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
