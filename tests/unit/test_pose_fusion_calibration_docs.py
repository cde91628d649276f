"""The documentation of the calibration."""

import re

from conftest import ROOT
from pose_common.parameters import markdown_table
from pose_fusion.calibration.parameters import LiveCalibrationParameters


def test_the_table_of_parameters_is_the_declared_one():
    text = (ROOT / "docs" / "calibration.md").read_text()
    table = re.search(r"<!-- parameters -->\n(.*?)<!-- /parameters -->", text, re.DOTALL)
    assert table
    assert table[1] == markdown_table(LiveCalibrationParameters)
