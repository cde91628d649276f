"""Invalid arguments of the synthetic subject's tools."""

import sys

import pytest

from pose_core.errors import InputError
from pose_sim.tools import generate, imu_device


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--duration", "inf"], "duration = inf s is too long"),
        (["--duration", "1e9"], r"duration = 1e\+09 s is too long"),
        (["--start-at", "99999999999999999999"], "start-at = 9+ ns is not UNIX time"),
    ],
)
def test_a_session_without_end_is_refused_at_once(monkeypatch, tmp_path, arguments, message):
    output = tmp_path / "session"
    monkeypatch.setattr(sys, "argv", ["generate", "-o", str(output), *arguments])
    with pytest.raises(InputError, match=message):
        generate.run()
    assert not output.exists()


def test_a_negative_seed_of_the_device_is_refused(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["imu_device", "session", "--link", "link", "--seed", "-1"])
    with pytest.raises(InputError, match="seed = -1 is negative"):
        imu_device.run()
