"""Files about a person."""

import os

import pytest

from pose_core.errors import InputError
from pose_core.private_file import write_private


@pytest.mark.parametrize("umask", [0o000, 0o022, 0o077])
def test_only_the_owner_may_read_whatever_the_umask(tmp_path, umask):
    before = os.umask(umask)
    try:
        write_private(tmp_path / "body.yaml", "a: 1\n", "the body's measures")
    finally:
        os.umask(before)

    assert (tmp_path / "body.yaml").stat().st_mode & 0o777 == 0o600


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "a.yaml"
    path.write_text("old")

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(InputError, match=r"cannot write the calibration .*No space left"):
        write_private(path, "new", "the calibration")

    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
