"""What nodes keep while a graph runs."""

import pytest

from pose_node.kept import KeptPerson, kept_file


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    return tmp_path / "pose_fusion"


def test_a_node_finds_its_file_again_within_a_run(state):
    path = kept_file("/lab/fusion", "r1")
    path.write_text("x")

    assert path == state / "lab_fusion-7-r1.yaml"
    assert kept_file("/lab/fusion", "r1").read_text() == "x"
    assert state.stat().st_mode & 0o777 == 0o700


def test_the_next_run_begins_anew_and_leaves_other_nodes_alone(state, monkeypatch):
    old, other = kept_file("/fusion", "r1"), kept_file("/calibration", "r1")
    old.write_text("x")
    other.write_text("x")

    assert not kept_file("/fusion", "r2").exists()
    assert not old.exists()
    assert other.exists()


def test_without_a_run_nothing_is_kept(state):
    assert kept_file("/fusion", "") is None
    assert not state.exists()


def test_a_home_that_cannot_be_written_keeps_nothing(state, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", "/proc/none")

    assert kept_file("/fusion", "r1") is None


def test_a_chosen_person_is_found_again(state):
    beside = kept_file("/fusion", "r1")
    assert KeptPerson(beside).load() == ""
    KeptPerson(beside).save("12")

    assert KeptPerson(kept_file("/fusion", "r1")).load() == "12"
    assert KeptPerson(kept_file("/fusion", "r2")).load() == ""
    assert KeptPerson(None).load() == ""
