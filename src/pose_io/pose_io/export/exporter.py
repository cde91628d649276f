"""Definition of an exporter: a function from a motion to a file's content."""

from collections.abc import Callable
from dataclasses import dataclass

from pose_io.export.motion import BodyMotion


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """Options of the command line that a format may use."""

    file_name: str = "motion"  # of the file that is written, with its ending
    rate: float = 30.0  # [Hz] of the motion, where it is constant
    opensim_model: str = "rajagopal2016"  # whose conventions OpenSim's angles follow


@dataclass(frozen=True, kw_only=True)
class Exporter:
    """An export format."""

    doc: str  # one line for ``--help``
    content: Callable[[BodyMotion, ExportOptions], bytes]
    constant_rate: bool = True  # it needs a constant rate; else each instant keeps its stamp
    fills_gaps: bool = False  # it cannot represent missing values: gaps are interpolated
    unknown_angles: str = ""  # what becomes of them, for the closing lines; empty: it has no angles
    rigid_bones: bool = False  # it cannot represent bones whose length changes
