"""What nodes keep while a graph runs."""

import pytest

from pose_core.errors import InputError
from pose_node.kept import Kept, kept_file


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    return tmp_path / "pose_fusion"


def test_a_restarted_node_finds_its_saved_state(state):
    path = kept_file("/lab/fusion", "r1")
    path.write_text("x")

    assert path == state / "lab_fusion-7-r1.yaml"
    assert kept_file("/lab/fusion", "r1").read_text() == "x"
    assert state.stat().st_mode & 0o777 == 0o700


def test_a_new_run_removes_only_the_nodes_own_old_state(state, monkeypatch):
    old, other = kept_file("/fusion", "r1"), kept_file("/calibration", "r1")
    old.write_text("x")
    other.write_text("x")

    assert not kept_file("/fusion", "r2").exists()
    assert not old.exists()
    assert other.exists()


def test_without_a_run_no_state_is_saved(state):
    assert kept_file("/fusion", "") is None
    assert not state.exists()


def test_in_a_read_only_home_no_state_is_saved(state, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", "/proc/none")

    assert kept_file("/fusion", "r1") is None


def test_a_saved_value_is_loaded_within_a_run(state):
    beside = kept_file("/fusion", "r1")
    assert Kept(beside, "person", str).load() is None
    Kept(beside, "person", str).save("12")

    assert Kept(kept_file("/fusion", "r1"), "person", str).load() == "12"
    assert Kept(kept_file("/fusion", "r2"), "person", str).load() is None
    assert not list(state.iterdir())
    assert Kept(None, "person", str).load() is None


def test_an_unreadable_saved_value_is_none(state):
    def refuse(_plain):
        raise InputError("not this")

    beside = kept_file("/fusion", "r1")
    Kept(beside, "person", str).save("12")
    assert Kept(beside, "person", refuse).load() is None

    next(state.iterdir()).write_text("{")
    assert Kept(beside, "person", str).load() is None
