"""Parameters of the fusion node, most of them also of ``./pose fuse``: the pipeline's and files."""

from dataclasses import dataclass

from pose_core.api import PipelineParameters
from pose_core.parameters import parameter, run_parameter


@dataclass(frozen=True, kw_only=True)
class FusionNodeParameters(PipelineParameters):
    """The pipeline's parameters, and the files with what is known before."""

    extrinsics_file: str = parameter(
        "", doc="YAML of the calibration; empty: /tf_static (`fuse` estimates what a bag lacks)"
    )
    imus_file: str = parameter(
        "",
        doc="YAML of the session whose section `imus` has the sensor-to-segment alignment; "
        "empty: `extrinsics_file`; without such a section: aligned from motion",
    )
    shape_file: str = parameter(
        "", doc="YAML of the bone lengths: read if it exists, otherwise written after measuring"
    )
    run: str = run_parameter()
