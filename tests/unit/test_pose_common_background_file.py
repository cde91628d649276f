"""A file that a thread writes to."""

import errno

import pytest

from pose_io.background_file import BackgroundFile


class FullDisk:
    """A file that takes a few bytes."""

    def __init__(self):
        self.written, self.closed = b"", False

    def tell(self):
        return 0

    def write(self, data):
        if len(self.written) + len(data) > 4:
            raise OSError(errno.ENOSPC, "No space left on device")
        self.written += data

    def close(self):
        self.closed = True


def write_much(file):
    for _ in range(1000):
        file.write(b"12345")


def test_all_pieces_are_written_in_their_order(tmp_path):
    path = tmp_path / "file"
    file = BackgroundFile(path.open("wb"))
    for number in range(300):
        assert file.tell() == 2 * number
        file.write(number.to_bytes(2, "big"))
    file.close()
    assert path.read_bytes() == b"".join(number.to_bytes(2, "big") for number in range(300))


def test_a_full_disk_is_told_when_the_file_is_closed():
    disk = FullDisk()
    file = BackgroundFile(disk)
    file.write(b"1234")
    file.write(b"5")
    with pytest.raises(OSError, match="No space left"):
        file.close()
    assert disk.closed
    assert disk.written == b"1234"


def test_a_full_disk_is_told_once_to_a_caller_that_goes_on_writing():
    disk = FullDisk()
    file = BackgroundFile(disk)
    with pytest.raises(OSError, match="No space left"):
        write_much(file)
    file.close()
    assert disk.written == b""


def test_closing_twice_does_nothing_more(tmp_path):
    file = BackgroundFile((tmp_path / "file").open("wb"))
    file.close()
    file.close()
