"""The SROS 2 policy of a graph: what each node publishes, subscribes to, serves and asks for."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

VERSION = "0.2.0"  # of sros2's policy schema


@dataclass(frozen=True, kw_only=True)
class NodeUse:
    """One node's topics and services, fully qualified."""

    publishes: Collection[str] = ()
    subscribes: Collection[str] = ()
    replies: Collection[str] = ()
    requests: Collection[str] = ()


def policy_xml(nodes: Mapping[tuple[str, str], NodeUse], enclave: str) -> str:
    """The policy that allows these nodes what they do, and nothing else.

    Args:
        nodes: By namespace and name.
        enclave: That all of them run in.
    """
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
