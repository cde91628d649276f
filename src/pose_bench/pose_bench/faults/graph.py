"""Faults of the graph: nodes that crash or hang, and floods of diagnostics."""

from pose_bench.faults.fault import Change, Fault, Signal, Window
from pose_bench.faults.packets import Note, Packet


def _diagnostics(rate: float) -> Change:
    """A publisher that floods ``/diagnostics``."""

    def flood(packets: list[Packet], window: Window) -> list[Packet]:
        count = round(rate * (window.end_s - window.begin_s))
        notes = [
            Note(at_s=window.begin_s + k / rate, source="diagnostics", stamp_ns=0, values={})
            for k in range(count)
        ]
        return sorted([*packets, *notes], key=lambda one: one.at_s)

    return flood


FAULTS = (
    Fault("fusion killed", signals=(Signal("kill", "fusion"),), lasts_s=0.1, silent=True),
    Fault("calibration killed", signals=(Signal("kill", "calibration"),), lasts_s=0.1),
    Fault("recorder killed", signals=(Signal("kill", "recorder"),), lasts_s=0.1),
    Fault(
        "calibration paused",
        signals=(Signal("pause", "calibration"), Signal("resume", "calibration", 4.0)),
    ),
    Fault("diagnostics flooded", _diagnostics(500.0)),
)
"""Faults of the graph."""
