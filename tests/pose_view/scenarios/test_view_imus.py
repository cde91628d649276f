"""What ``./pose view`` says of IMUs, and where it draws them (synthetic)."""

from dataclasses import replace

import pytest
from fused_bag import S, write_fused_bag
from session_bag import write_session
from synthetic_body import extrinsics
from worn_imus import merged, moving_wearer

from pose_io.bags import open_bag
from pose_view.recorded import Recorded
from pose_view.tools.view import read

STUCK = "left_forearm"


@pytest.fixture
def worn(tmp_path):
    """A bag of cameras and IMUs, of which one always sends the same orientation."""
    _, _, skeletons, imus = moving_wearer(9.0)
    first = {s.segment: s for s in reversed(imus)}
    sent = [replace(first[STUCK], stamp_ns=s.stamp_ns) if s.segment == STUCK else s for s in imus]
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    return write_session(tmp_path / "worn", merged(skeletons, sent), placed)


def test_an_imu_that_no_computed_body_uses_is_named_and_not_drawn(worn, capsys):
    recorded = read(worn, ("subject",))

    (line,) = [remark for remark in recorded.remarks if STUCK in remark]
    assert line.startswith(f"subject: IMU {STUCK}: not used, ")
    assert line in capsys.readouterr().err.splitlines()
    assert recorded.has_imus
    assert recorded.snapshot(0.0).imus == ()
    drawn = recorded.snapshot(8.0).imus
    assert "left_thigh" in drawn
    assert STUCK not in drawn


def test_imus_of_a_recorded_body_are_drawn_from_when_its_fusion_used_them(tmp_path):
    uses = {"imu/torso": "torso: not used, not aligned yet", "imu/head": "head: not used, stuck"}
    values = {"subject": "subject", "estimator": "default", **uses}
    aligned = {**values, "imu/torso": "torso: used from 2.0 s on"}
    reports = {1.0: ("/fusion", values), 3.0: ("/fusion", aligned)}
    with open_bag(write_fused_bag(tmp_path / "bag", reports)) as bag:
        recorded = Recorded(bag)

    assert recorded.remarks == ["IMU head: not used, stuck"]
    since_s = 3.0 - recorded.start_ns / S
    assert recorded.snapshot(since_s - 0.1).imus == ()
    assert recorded.snapshot(since_s + 0.1).imus == ("torso",)
