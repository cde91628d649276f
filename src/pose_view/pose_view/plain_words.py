"""Status lines of the graph."""

from collections.abc import Iterable
from dataclasses import dataclass
from html import escape

from pose_core.stamps import NS_PER_S
from pose_fusion.watching.observation import TopicStatus
from pose_node.node_status import Level, NodeStatus

SILENT_AFTER_S = 1.0  # [s]
NODE_SILENT_AFTER_S = 3.5  # [s] nodes report once a second


COLORS = ("#2f9e5f", "#e08a00", "#d0312d", "#a9adb5")
"""Of the dots, by level; grey: nothing is known."""


@dataclass(frozen=True, kw_only=True)
class StatusLine:
    """One status line."""

    level: Level
    title: str
    text: str


def stream_line(title: str, status: TopicStatus, delay_s: float | None = None) -> StatusLine:
    """Status of a stream of skeletons or bodies.

    Args:
        title: Title of the line.
        status: Rate, delay and gaps.
        delay_s: Delay stated by the stream itself [s].
    """
    if status.age_s is None:
        return StatusLine(level=Level.STALE, title=title, text="nothing yet")
    if status.age_s > SILENT_AFTER_S:
        return StatusLine(level=Level.ERROR, title=title, text=f"silent for {status.age_s:.0f} s")
    delay_s = status.latency_s if delay_s is None else delay_s
    text = f"{status.rate:.0f} Hz"
    if delay_s is not None:
        text += f", {1e3 * delay_s:.0f} ms after capture"
    if status.gaps:
        gaps = "1 dropout" if status.gaps == 1 else f"{status.gaps} dropouts"
        text += f", {gaps} in a minute (longest {status.longest_gap_s:.1f} s)"
    level = Level.WARN if status.gaps else Level.OK
    return StatusLine(level=level, title=title, text=text)


def imu_line(report: NodeStatus | None, now_ns: int) -> StatusLine:
    """Status of all IMUs, from their bridge's report."""
    if report is None:
        return StatusLine(level=Level.STALE, title="IMUs", text="no imu_bridge")
    values = report.values.items()
    rates = [float(value) for key, value in values if key.endswith(".rate_hz")]
    lost = sum(int(value) for key, value in values if key.endswith(".lost"))
    text = report.message
    if rates:
        sending = [rate for rate in rates if rate > 0.0]
        mean = sum(sending) / len(sending) if sending else 0.0
        text = f"{len(sending)} of {len(rates)} send, {mean:.0f} Hz each"
        if lost:
            text += f", {lost} frames lost on the air"
        if report.level:
            text += f"; {report.message}"
    return node_line("IMUs", report, now_ns, text)


def node_line(
    title: str, report: NodeStatus | None, now_ns: int, text: str | None = None
) -> StatusLine:
    """Status of a node, with its own message or another text."""
    if report is None:
        return StatusLine(level=Level.STALE, title=title, text="not running")
    age_s = (now_ns - report.received_ns) / NS_PER_S
    if age_s > NODE_SILENT_AFTER_S:
        return StatusLine(level=Level.ERROR, title=title, text=f"silent for {age_s:.0f} s")
    return StatusLine(level=report.level, title=title, text=text or report.message)


def as_html(lines: Iterable[StatusLine]) -> str:
    """The lines with coloured dots."""
    rows = "".join(
        f'<div style="display:flex;align-items:baseline;margin:0.25em 0">'
        f'<span style="flex:none;width:0.65em;height:0.65em;border-radius:50%;margin-right:0.5em;'
        f'background:{COLORS[line.level]}"></span>'
        f"<span><b>{escape(line.title)}</b> {escape(line.text)}</span></div>"
        for line in lines
    )
    return f'<div style="padding:0.25em 0.75em;font-size:0.85em;line-height:1.35">{rows}</div>'
