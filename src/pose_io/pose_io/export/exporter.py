"""What an exporter is: a motion in, a file's content out."""

from collections.abc import Callable
from dataclasses import dataclass

from pose_io.export.motion import BodyMotion


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """What a format may ask of the command line."""

    file_name: str = "motion"  # of the file that is written, with its ending
    rate: float = 30.0  # [Hz] of the motion, where it is constant
    opensim_model: str = "rajagopal2016"  # whose conventions OpenSim's angles follow


@dataclass(frozen=True, kw_only=True)
class Exporter:
    """One format."""

    doc: str  # one line for people
    content: Callable[[BodyMotion, ExportOptions], bytes]
    constant_rate: bool = True  # it gets the motion at one; else each instant keeps its stamp
    fills_gaps: bool = False  # it cannot leave out what is not known: gaps are interpolated
    rigid_bones: bool = False  # it cannot hold bones whose length changes
