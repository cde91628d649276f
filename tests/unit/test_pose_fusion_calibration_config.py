"""The parameter file of the calibration node."""

from conftest import ROOT
from pose_common.parameters import from_ros_yaml
from pose_fusion.calibration.parameters import LiveCalibrationParameters


def test_the_parameter_file_holds_known_parameters_with_their_defaults():
    path = ROOT / "src" / "pose_fusion" / "config" / "calibration.yaml"
    parameters = from_ros_yaml(LiveCalibrationParameters, path, "calibration")
    assert parameters == LiveCalibrationParameters()
