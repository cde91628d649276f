"""Atomic writing of files, and who may read them."""

import os

import pytest

from pose_core.atomic_file import write_atomically
from pose_core.errors import InputError


@pytest.mark.parametrize("umask", [0o000, 0o022, 0o077])
def test_only_the_owner_may_read_whatever_the_umask(tmp_path, umask):
    before = os.umask(umask)
    try:
        write_atomically(tmp_path / "body.yaml", b"a: 1\n", "the body's measures")
    finally:
        os.umask(before)

    assert (tmp_path / "body.yaml").stat().st_mode & 0o777 == 0o600


def test_a_file_for_everybody_heeds_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomically(tmp_path / "walk.trc", b"x", "the motion", mode=0o666)
    finally:
        os.umask(before)

    assert (tmp_path / "walk.trc").stat().st_mode & 0o777 == 0o640


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "a.yaml"
    path.write_text("old")

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(InputError, match=r"cannot write the calibration .*No space left"):
        write_atomically(path, b"new", "the calibration")

    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
