import os
import tempfile
import time

import pytest

from pose_launch import parameter_folder as module
from pose_launch.parameter_folder import parameter_folder, remove_stale


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def make_old(folder):
    folder.mkdir(exist_ok=True)
    (folder / "fusion.0.yaml").write_text("x")
    an_hour_ago = time.time() - 3600.0
    os.utime(folder, (an_hour_ago, an_hour_ago))


def test_a_killed_run_s_folder_goes_with_the_next_start(temporary):
    make_old(temporary / "pose_up_killed")

    with parameter_folder() as folder:
        assert list(temporary.iterdir()) == [folder]

    assert list(temporary.iterdir()) == []


def test_a_living_run_s_folder_stays(temporary):
    with parameter_folder() as folder:
        make_old(folder)
        remove_stale()
        assert (folder / "fusion.0.yaml").exists()


def test_a_run_that_is_about_to_lock_its_folder_keeps_it(temporary):
    (temporary / "pose_up_new").mkdir()
    remove_stale()
    assert (temporary / "pose_up_new").exists()


def test_other_people_s_folders_and_files_stay(temporary, monkeypatch):
    make_old(temporary / "pose_up_theirs")
    make_old(temporary / "something_else")
    monkeypatch.setattr(module.os, "getuid", lambda: 12345)
    remove_stale()
    assert len(list(temporary.iterdir())) == 2
