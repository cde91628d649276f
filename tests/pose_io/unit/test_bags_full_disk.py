"""Writing a bag to a full disk: an error of one line, and no files left."""

import errno
import os
import sqlite3

import pytest

from pose_core.errors import InputError
from pose_io.bag_writer import BagWriter

FULL = (
    OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)),
    sqlite3.OperationalError("database or disk is full"),
)


def refusing(error):
    def refuse(*_):
        raise error

    return refuse


@pytest.mark.parametrize("error", FULL)
@pytest.mark.parametrize("method", ["write", "close"])
def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path, monkeypatch, error, method):
    def write():
        with BagWriter(tmp_path / "bag") as bag:
            bag.add_topic("/text", "std_msgs/msg/String")
            monkeypatch.setattr(bag._writer.storage, method, refusing(error))
            bag.write_serialized("/text", "std_msgs/msg/String", b"\0" * 12, 1)

    with pytest.raises(InputError, match=r"cannot write .*bag: .*(No space left|disk is full)"):
        write()
    assert list(tmp_path.iterdir()) == []
