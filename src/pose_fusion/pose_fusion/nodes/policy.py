"""``./pose policy``: the SROS 2 policy file of the running graph."""

import argparse
import time
from collections.abc import Collection, Mapping
from pathlib import Path
from xml.etree import ElementTree

from rclpy.node import Node

from pose_core.errors import InputError, writing
from pose_node.command_line import run_tool
from pose_node.nodes.running import node_of_tool

VERSION = "0.2.0"  # of sros2's policy schema
LOOKED_S = 3.0  # [s] of discovery
RIGHTS = {
    ("topic", "publish"): Node.get_publisher_names_and_types_by_node,
    ("topic", "subscribe"): Node.get_subscriber_names_and_types_by_node,
    ("service", "reply"): Node.get_service_names_and_types_by_node,
    ("service", "request"): Node.get_client_names_and_types_by_node,
}
"""Functions that list the names which a node uses with a right to a kind of names."""
NodeUse = Mapping[tuple[str, str], Collection[str]]
"""One node's names, fully qualified, by the keys of :data:`RIGHTS`."""


def policy_xml(nodes: Mapping[tuple[str, str], NodeUse], enclave: str) -> str:
    """A policy with exactly the rights that these nodes, by namespace and name, use."""
    policy = ElementTree.Element("policy", version=VERSION)
    enclaves = ElementTree.SubElement(policy, "enclaves")
    profiles = ElementTree.SubElement(
        ElementTree.SubElement(enclaves, "enclave", path=enclave), "profiles"
    )
    for namespace, name in sorted(nodes):
        profile = ElementTree.SubElement(profiles, "profile", ns=namespace, node=name)
        prefix = namespace.rstrip("/") + "/"
        for (kind, right), names in nodes[namespace, name].items():
            if names:
                rule = ElementTree.SubElement(profile, f"{kind}s", {right: "ALLOW"})
            # Relative to the node's namespace where they are within it, as sros2 writes them.
            for each in sorted({each.removeprefix(prefix) for each in names}):
                ElementTree.SubElement(rule, kind).text = each
    ElementTree.indent(policy)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(policy, "unicode")


def graph_of(node: Node) -> dict[tuple[str, str], NodeUse]:
    """Topics and services of the other nodes of the graph, by namespace and name."""
    return {
        (namespace, name): {
            right: [each for each, _ in names_of(node, name, namespace)]
            for right, names_of in RIGHTS.items()
        }
        for name, namespace in set(node.get_node_names_and_namespaces())
        if name != node.get_name() and not name.startswith("_")
    }


def make_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="pose policy",
        description="Write the SROS 2 policy of the running graph: each node gets the rights"
        " that it uses now, and no others.",
    )
    parser.add_argument("-o", "--output", type=Path, help="the file; printed if left out")
    parser.add_argument("--enclave", default="/pose", help="enclave of all nodes (/pose)")
    return parser


def run(arguments: list[str] | None = None) -> None:
    """The tool."""
    options = make_parser().parse_args(arguments)
    with node_of_tool(lambda: Node("policy_writer", enable_rosout=False)) as (node, _):
        time.sleep(LOOKED_S)
        nodes = graph_of(node)
    if not nodes:
        raise InputError("no node runs: start the graph first, for example with ./pose up")
    text = policy_xml(nodes, options.enclave) + "\n"
    if options.output is None:
        print(text, end="")
        return
    with writing(options.output):
        options.output.write_text(text)
    print(f"{options.output}: {len(nodes)} nodes")


def main() -> None:
    """Run the tool and exit."""
    run_tool(run)
