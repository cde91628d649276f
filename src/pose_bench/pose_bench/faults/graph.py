"""Faults of the graph: nodes that crash, hang or run twice; other publishers on topics."""

from pose_bench.faults.fault import Fault, Signal, Window
from pose_bench.faults.packets import Note, Packet


def _diagnostics(rate: float):  # type: ignore[no-untyped-def]
    """A publisher that floods ``/diagnostics``."""

    def flood(packets: list[Packet], window: Window) -> list[Packet]:
        count = round(rate * (window.end_s - window.begin_s))
        notes = [
            Note(at_s=window.begin_s + k / rate, source="diagnostics", stamp_ns=0, values={})
            for k in range(count)
        ]
        return sorted([*packets, *notes], key=lambda one: one.at_s)

    return flood


def _signal(what: str, node: str, after_s: float = 0.0) -> Signal:
    return Signal(after_s=after_s, what=what, node=node)


FAULTS = (
    Fault(name="fusion killed", signals=(_signal("kill", "fusion"),), lasts_s=0.1, silent=True),
    Fault(name="calibration killed", signals=(_signal("kill", "calibration"),), lasts_s=0.1),
    Fault(name="recorder killed", signals=(_signal("kill", "recorder"),), lasts_s=0.1),
    Fault(
        name="calibration paused",
        signals=(_signal("pause", "calibration"), _signal("resume", "calibration", 4.0)),
    ),
    Fault(name="diagnostics flooded", change=_diagnostics(500.0)),
)
"""Faults of the graph."""
