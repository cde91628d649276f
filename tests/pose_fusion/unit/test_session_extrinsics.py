"""The sensors of a bag, and their extrinsics for the offline tools (synthetic)."""

import numpy as np
import pytest
from session_bag import write_session
from synthetic_body import extrinsics
from worn_imus import merged, moving_wearer

from pose_calibration.files.extrinsics_file import save_extrinsics
from pose_calibration.inertial import imu_gravity
from pose_core.session.extrinsics import extrinsics_from_map
from pose_fusion.session_extrinsics import checked_sensors, find_extrinsics
from pose_io.bags import open_bag


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    _, _, skeletons, imus = moving_wearer(20.0)
    path = write_session(tmp_path_factory.mktemp("session") / "in", merged(skeletons, imus))
    with open_bag(path) as opened:
        yield opened


@pytest.mark.parametrize("order", [("left", "right"), ("right", "left")])
def test_sensors_that_are_not_named_come_in_the_order_of_the_extrinsics_file(bag, tmp_path, order):
    path = tmp_path / "extrinsics.yaml"
    save_extrinsics(path, extrinsics_from_map({s: extrinsics().T_map_sensor(s) for s in order}))
    assert checked_sensors(bag, (), str(path)) == order
    assert checked_sensors(bag, ("left", "right"), str(path)) == ("left", "right")
    assert checked_sensors(bag) == ("left", "right")


def test_a_file_of_more_sensors_serves_for_some_of_them(bag, tmp_path):
    path = tmp_path / "extrinsics.yaml"
    save_extrinsics(path, extrinsics())
    found = find_extrinsics(bag, ("right",), lambda _: None, str(path), imus=False)
    assert found.sensors == ("right",)
    np.testing.assert_allclose(
        found.T_map_sensor("right"), extrinsics().T_map_sensor("right"), atol=1e-5
    )


@pytest.mark.parametrize("imus", [True, False])
def test_the_vertical_comes_from_imus_only_where_they_are_used(bag, imus, monkeypatch):
    monkeypatch.setattr(imu_gravity, "IMUS_COUNT_BELOW", 2.0)  # however little they improve it
    said = []
    find_extrinsics(bag, ("left", "right"), said.append, imus=imus)
    assert any("body-worn IMUs" in line for line in said) == imus
