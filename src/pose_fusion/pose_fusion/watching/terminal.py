"""A graph's state as a page of text that fits into 80 columns and 24 lines."""

from collections.abc import Sequence

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from pose_core.api import FloatArray
from pose_core.joints import JOINT_INDEX, JOINTS, SIDES
from pose_fusion.watching.observation import GraphSnapshot, TopicStatus
from pose_io.names import BODIES
from pose_io.topics import BODY_TOPIC, IMU_TOPIC, SENSOR_TOPIC
from pose_node.node_status import Level, NodeStatus

SILENT_S = 1.0  # [s] a topic without messages for longer is shown as silent
REPLAYED_S = 60.0  # [s] what is stamped longer ago comes from a recording
MIDDLE = ("head", "neck", "torso")
PAIRED = tuple(joint.partition("_")[2] for joint in JOINTS if joint.startswith("left_"))
LEVEL_STYLE = {Level.OK: "green", Level.WARN: "yellow", Level.ERROR: "red", Level.STALE: "red"}
NAME_WIDTH = 14  # [columns] of a node's name
GOOD_SHARE, FAIR_SHARE = 0.9, 0.5  # [-]


def page(snapshot: GraphSnapshot, clock: str, height: int = 24) -> RenderableType:
    """The whole page, at most ``height`` lines."""
    topics = _topic_rows(snapshot)
    parts: list[RenderableType] = [_title(snapshot, clock), _topics_table(topics)]
    used = 2 + len(topics)
    seen = sorted(snapshot.tracked, key=lambda name: (bool(BODY_TOPIC.search(name)), name))
    shares = {name: snapshot.tracked[name] for name in seen}
    tracked = {name: share for name, share in shares.items() if np.isfinite(share).any()}
    if tracked:
        parts.append(_tracking_table(tracked))
        used += 1 + len(MIDDLE) + len(PAIRED)
    parts.append(_warnings(snapshot.statuses, max(2, height - used - 1)))
    return Group(*parts)


def _title(snapshot: GraphSnapshot, clock: str) -> Text:
    title = Text.assemble(("pose top", "bold"), f"  {clock}  ")
    title.append(f"{len(snapshot.nodes)} nodes, {len(snapshot.topics)} topics; ")
    placed = ", ".join(snapshot.placed_sensors)
    title.append(f"extrinsics: {placed}" if placed else "extrinsics: not known yet")
    title.truncate(80, overflow="ellipsis")
    return title


Row = tuple[str, str, str, str, bool]  # name, rate, latency, age, whether it is silent


def _topic_rows(snapshot: GraphSnapshot) -> list[Row]:
    """Kinects, the IMUs together, the body, /tf."""
    topics = snapshot.topics
    rows = [_row(topic.name, [topic]) for topic in topics if SENSOR_TOPIC.search(topic.name)]
    imus = [topic for topic in topics if IMU_TOPIC.search(topic.name)]
    if imus:
        rows.append(_row(f"imu_*/data ({len(imus)} IMUs)", imus))
    rows += [
        _row(topic.name.replace(BODIES, "/").lstrip("/"), [topic])
        for topic in topics
        if (match := BODY_TOPIC.search(topic.name)) and match["leaf"] == "joint_states"
    ]
    if snapshot.fusion_latency_s is not None:
        median, p99 = (1000.0 * value for value in snapshot.fusion_latency_s)
        latency = f"{median:.0f}, p99 {p99:.0f}"
        rows.append(("newest sample to the fusion's output", "", latency, "", False))
    return rows


def _row(name: str, topics: Sequence[TopicStatus]) -> Row:
    rates = [topic.rate for topic in topics]
    low, high = min(rates), max(rates)
    rate = f"{low:.1f}" if high - low < 1.0 else f"{low:.0f}–{high:.0f}"
    latencies = [topic.latency_s for topic in topics if topic.latency_s is not None]
    latency = _latency(max(latencies)) if latencies else "–"
    ages = [topic.age_s for topic in topics]
    known = [age for age in ages if age is not None]
    is_silent = len(known) < len(ages) or max(known) > SILENT_S
    age = f"{max(known):.1f}" if len(known) == len(ages) else "never"
    return name, rate, latency, age, is_silent


def _latency(latency_s: float) -> str:
    return f"{1000.0 * latency_s:.0f}" if abs(latency_s) < REPLAYED_S else "replayed"


def _topics_table(rows: Sequence[Row]) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    table.add_column("topic", no_wrap=True, width=36, overflow="ellipsis")
    for header in ("rate [Hz]", "latency [ms]", "last [s ago]"):
        table.add_column(Text(header), justify="right", no_wrap=True)
    for name, rate, latency, age, is_silent in rows:
        table.add_row(name, rate, latency, age, style="red" if is_silent else "")
    if not rows:
        table.add_row("no messages yet: try ./pose doctor", "", "", "", style="yellow")
    return table


def _tracking_table(tracked: dict[str, FloatArray]) -> Table:
    """Per joint, for each source the left and the right one."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    table.add_column(Text("tracked [%]\nleft right"), no_wrap=True)
    for name in tracked:
        # Two lines, so that five sources fit into 80 columns.
        first, _, second = _short(name).partition("_")
        table.add_column(Text(f"{first}\n{second}"), justify="right", no_wrap=True)
    for joint in (*MIDDLE, *PAIRED):
        names = (joint,) if joint in MIDDLE else tuple(f"{side}_{joint}" for side in SIDES)
        cells = [
            Text(" ").join(_share(share[JOINT_INDEX[name]]) for name in names)
            for share in tracked.values()
        ]
        table.add_row(joint, *cells)
    return table


def _short(topic: str) -> str:
    if match := SENSOR_TOPIC.search(topic):
        return f"kinect_{match['name']}"
    match = BODY_TOPIC.search(topic)
    return match["body"] if match else topic


def _share(share: float) -> Text:
    style = "green" if share >= GOOD_SHARE else "yellow" if share >= FAIR_SHARE else "red"
    return Text(f"{100.0 * share:3.0f}", style)


def _warnings(statuses: Sequence[NodeStatus], lines: int) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), show_header=False, width=80)
    table.add_column(no_wrap=True, style="bold", width=NAME_WIDTH, overflow="ellipsis")
    table.add_column(no_wrap=True, overflow="ellipsis", ratio=1)
    ordered = sorted(statuses, key=lambda status: -status.level)
    room = lines if len(ordered) <= lines else lines - 1
    for status in ordered[:room]:
        style = LEVEL_STYLE[status.level]
        name = status.name.lstrip("/")
        if len(name) > NAME_WIDTH:  # the namespace is cut
            name = f"…{name[1 - NAME_WIDTH :]}"
        table.add_row(name, Text(status.message, style))
    if len(ordered) > room:
        table.add_row("…", f"and {len(ordered) - room} more nodes, in /diagnostics")
    if not ordered:
        table.add_row("", Text("no node reports to /diagnostics", "yellow"))
    return table
