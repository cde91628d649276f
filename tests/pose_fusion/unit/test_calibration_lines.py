from dataclasses import replace

import numpy as np
import pytest

from pose_core.api import Clock, extrinsics_from_map
from pose_fusion.calibration_lines import TRACKERS, clocks_line


@pytest.mark.parametrize(
    ("drift", "stddev", "said"),
    [
        (3.3e-4, 3e-6, "right +62 ms (+19.8 ms a minute)"),
        (4.5e-5, 3e-6, "right +62 ms"),
        (3.3e-4, 2e-4, "right +62 ms"),
    ],
)
def test_a_clock_that_drifts_more_than_a_quartz_is_named_with_its_drift(drift, stddev, said):
    clocks = {"right": Clock(offset_ns=62_000_000, drift=drift, drift_stddev=stddev)}
    placed = extrinsics_from_map({"left": np.eye(4), "right": np.eye(4)})
    extrinsics = replace(placed, clocks=clocks)
    assert (
        clocks_line(extrinsics, "by motion")
        == f"clocks: ahead of left's by motion: {said}{TRACKERS}"
    )
