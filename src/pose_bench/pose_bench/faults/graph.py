"""Faults of the graph: nodes that crash or hang, and floods of diagnostics."""

import numpy as np

from pose_bench.faults.fault import Fault, Signal, Window
from pose_bench.faults.packets import Note, Packet

FLOOD = 500.0  # [Hz]


def _flooded(packets: list[Packet], window: Window) -> list[Packet]:
    """A publisher that floods ``/diagnostics``."""
    times = np.arange(window.begin_s, window.end_s, 1.0 / FLOOD).tolist()
    notes = [Note(at_s=at_s, source="diagnostics", stamp_ns=0) for at_s in times]
    return sorted([*packets, *notes], key=lambda one: one.at_s)


FAULTS = (
    Fault("fusion killed", signals=(Signal("kill", "fusion"),), lasts_s=0.1, silent=True),
    Fault("calibration killed", signals=(Signal("kill", "calibration"),), lasts_s=0.1),
    Fault("recorder killed", signals=(Signal("kill", "recorder"),), lasts_s=0.1),
    Fault(
        "calibration paused",
        signals=(Signal("pause", "calibration"), Signal("resume", "calibration", 4.0)),
    ),
    Fault("diagnostics flooded", _flooded),
)
"""Faults of the graph."""
