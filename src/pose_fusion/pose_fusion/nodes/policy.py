"""``./pose policy``: the SROS 2 policy file of the running graph."""

import argparse
import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from rclpy.node import Node

from pose_core.errors import InputError, writing
from pose_node.command_line import run_tool
from pose_node.nodes.running import node_of_tool

VERSION = "0.2.0"  # of sros2's policy schema


LOOKED_S = 3.0  # [s] of discovery


@dataclass(frozen=True, kw_only=True)
class NodeUse:
    """One node's topics and services, fully qualified."""

    publishes: Collection[str] = ()
    subscribes: Collection[str] = ()
    replies: Collection[str] = ()
    requests: Collection[str] = ()


def policy_xml(nodes: Mapping[tuple[str, str], NodeUse], enclave: str) -> str:
    """A policy with exactly the rights that these nodes, by namespace and name, use."""
    policy = ElementTree.Element("policy", version=VERSION)
    enclaves = ElementTree.SubElement(policy, "enclaves")
    profiles = ElementTree.SubElement(
        ElementTree.SubElement(enclaves, "enclave", path=enclave), "profiles"
    )
    for (namespace, name), use in sorted(nodes.items()):
        profile = ElementTree.SubElement(profiles, "profile", ns=namespace, node=name)
        _rule(profile, namespace, "topic", "publish", use.publishes)
        _rule(profile, namespace, "topic", "subscribe", use.subscribes)
        _rule(profile, namespace, "service", "reply", use.replies)
        _rule(profile, namespace, "service", "request", use.requests)
    ElementTree.indent(policy)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(policy, "unicode")


def _rule(
    profile: ElementTree.Element, namespace: str, kind: str, does: str, names: Collection[str]
) -> None:
    if not names:
        return
    rule = ElementTree.SubElement(profile, f"{kind}s", {does: "ALLOW"})
    prefix = namespace.rstrip("/") + "/"
    # Relative to the node's namespace where they are within it, as sros2 writes them.
    for name in sorted({name.removeprefix(prefix) for name in names}):
        ElementTree.SubElement(rule, kind).text = name


def graph_of(node: Node) -> dict[tuple[str, str], NodeUse]:
    """Topics and services of the other nodes of the graph, by namespace and name."""
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
