"""The parameter file of the calibration node."""

from pathlib import Path

from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.parameters import from_ros_yaml

ROOT = Path(__file__).parents[3]


def test_the_parameter_file_holds_known_parameters_with_their_defaults():
    path = ROOT / "src" / "pose_fusion" / "config" / "calibration.yaml"
    parameters = from_ros_yaml(LiveCalibrationParameters, path, "calibration")
    assert parameters == LiveCalibrationParameters()
