import os
import select
import stat
from contextlib import closing

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_sim.serial_device import BATCH_NS, PseudoTerminal, over_the_air, transmit

MS = 1_000_000


class FakeTime:
    """A clock that runs on only when someone sleeps."""

    def __init__(self, now_ns=0):
        self.now_ns = now_ns

    def __call__(self):
        return self.now_ns

    def sleep(self, seconds):
        assert seconds >= 0.0
        self.now_ns += round(seconds * 1e9) + 1000


def on_air(count, lost=0.0, corrupted=0.0, jitter_s=0.0, period_ns=10 * MS):
    due = np.arange(count, dtype=np.int64) * period_ns
    frames = [f"{index:04d}".encode() for index in range(count)]
    rng = np.random.default_rng(0)
    return over_the_air(due, frames, lost=lost, corrupted=corrupted, jitter_s=jitter_s, rng=rng)


def read_some(path, enough=1):
    """What comes until there is enough: the kernel passes bytes on in its own time."""
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY)
    data = b""
    try:
        while len(data) < enough and select.select([reader], [], [], 10.0)[0]:
            data += os.read(reader, 4096)
    finally:
        os.close(reader)
    return data


class Recorder:
    """In place of a terminal: what was written, and when."""

    def __init__(self, clock):
        self.clock = clock
        self.written = []

    def write(self, data):
        self.written.append((self.clock(), data))

    def unread(self):
        return 0


def send(transmission, start_ns=0, now_ns=0, stop_after_ns=None):
    clock = FakeTime(now_ns)
    recorder = Recorder(clock)
    sent = transmit(
        recorder,
        transmission,
        start_ns,
        stopped=lambda: stop_after_ns is not None and clock.now_ns >= stop_after_ns,
        clock=clock,
        sleep=clock.sleep,
    )
    return sent, recorder.written


def test_frames_go_out_when_they_are_due_and_never_early():
    sent, written = send(on_air(50), start_ns=500 * MS)
    assert sent.sent == 50
    assert sent.finished
    for index, (when_ns, data) in enumerate(written):
        assert data == f"{index:04d}".encode()
        assert 0 <= when_ns - (500 + 10 * index) * MS < MS


def test_frames_due_together_go_out_together_within_the_batch_time():
    transmission = on_air(40, period_ns=MS)
    sent, written = send(transmission)
    assert sent.sent == 40
    assert len(written) < 15
    index = 0
    for when_ns, data in written:
        assert when_ns - transmission.due_ns[index] <= BATCH_NS + MS
        index += len(data) // 4


def test_what_is_past_at_the_start_is_skipped():
    sent, written = send(on_air(100), start_ns=0, now_ns=505 * MS)
    assert sent.skipped == 51
    assert sent.sent == 49
    assert written[0][1] == b"0051"


def test_it_stops_on_request():
    sent, _ = send(on_air(100), stop_after_ns=305 * MS)
    assert not sent.finished
    assert sent.sent == 31


def test_lost_frames_never_arrive_and_are_counted():
    transmission = on_air(1000, lost=0.2)
    assert transmission.lost == 1000 - len(transmission.frames)
    assert 150 < transmission.lost < 250


def test_a_garbled_frame_differs_and_is_counted():
    clean, garbled = on_air(1000), on_air(1000, corrupted=0.1)
    changed = sum(a != b for a, b in zip(clean.frames, garbled.frames, strict=True))
    assert changed == garbled.corrupted
    assert 60 < changed < 140


def test_jitter_only_delays_and_keeps_the_order():
    clean, late = on_air(500), on_air(500, jitter_s=0.02)
    assert np.all(late.due_ns >= clean.due_ns)
    assert np.all(np.diff(late.due_ns) >= 0)
    assert np.mean(late.due_ns - clean.due_ns) > 10 * MS


def test_a_reader_finds_the_bytes_unchanged_under_the_link(tmp_path):
    everything = bytes(range(256))  # a terminal that is not raw would swallow some
    with closing(PseudoTerminal(tmp_path / "tty")) as terminal:
        assert stat.S_ISCHR(os.stat(terminal.link).st_mode)
        terminal.write(everything)
        assert read_some(terminal.link, enough=256) == everything


def test_bytes_that_are_not_read_are_lost_and_counted(tmp_path):
    with closing(PseudoTerminal(tmp_path / "tty")) as terminal:
        for _ in range(3000):
            terminal.write(bytes(100))
        kept = terminal.counters["bytes_written"]
        assert kept + terminal.counters["bytes_unread"] == 300_000
        assert terminal.counters["bytes_unread"] > 200_000
        assert len(read_some(terminal.link, enough=kept)) == kept


def test_the_link_is_removed_afterwards(tmp_path):
    with closing(PseudoTerminal(tmp_path / "tty")) as terminal:
        assert terminal.link.is_symlink()
    assert list(tmp_path.iterdir()) == []


def test_a_link_left_behind_is_replaced(tmp_path):
    link = tmp_path / "tty"
    link.symlink_to("/dev/pts/999999")
    with closing(PseudoTerminal(link)) as terminal:
        assert os.readlink(link) == terminal.device


@pytest.mark.parametrize("kind", ["file", "folder", "other link"])
def test_another_file_at_the_links_path_is_not_replaced(tmp_path, kind):
    link = tmp_path / "tty"
    if kind == "file":
        link.write_text("precious")
    elif kind == "folder":
        link.mkdir()
    else:
        link.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="not a virtual device"):
        PseudoTerminal(link)
    assert link.is_symlink() or link.exists()


def test_a_link_in_a_folder_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot make the link"):
        PseudoTerminal(tmp_path / "nowhere" / "tty")
