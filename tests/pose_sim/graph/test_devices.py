"""The tools as processes: a session's IMU frames over a real pseudo-terminal."""

import os
import re
import select
import signal
import time

import pytest
from patience import PATIENCE_S

from imu_bridge.protocols.star import StarParser
from pose_sim.imu_file import encode_all
from pose_sim.session import make_session, settings_of
from pose_sim.session_folder import write_session
from pose_sim.virtual_imu import NODES

SAMPLE_FRAME_BYTES = 33  # of the star protocol

pytestmark = pytest.mark.graph
RUN = ["python", "-c", "import sys; from pose_sim.tools.{0} import main; main()"]
DURATION_S = 6.0
SUMMARY = re.compile(
    r"finished: (\d+) of (\d+) synthetic frames sent; of all, (\d+) lost and (\d+) corrupted by "
    r"the radio link, (\d+) past already; (\d+) bytes unread"
)


def tool(name, *words):
    return [*RUN[:2], RUN[2].format(name), *map(str, words)]


@pytest.fixture(scope="module")
def session():
    return make_session("bow", DURATION_S, 2, settings_of())


@pytest.fixture
def folder(session, tmp_path):
    write_session(tmp_path / "s", session, 0)
    return tmp_path / "s"


def read_until_it_ends(process, link, deadline_s=PATIENCE_S):
    reader = os.open(link, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
    data = b""
    deadline = time.monotonic() + deadline_s
    try:
        while time.monotonic() < deadline:
            if select.select([reader], [], [], 0.1)[0]:
                try:
                    chunk = os.read(reader, 65536)
                except OSError:  # the other end is closed
                    break
                if not chunk:
                    break
                data += chunk
            elif process.returncode is not None:
                break
    finally:
        os.close(reader)
    return data


def test_every_frame_of_the_session_arrives_over_the_terminal(
    start_process, folder, session, tmp_path
):
    link = tmp_path / "tty"
    start_ns = time.time_ns() + 3_000_000_000
    process = start_process(
        tool("imu_device", folder, "--link", link, "--start-at", start_ns)
        + ["--lost", "0", "--corrupted", "0"]
    )
    process.wait_for_output("synthetic")
    data = read_until_it_ends(process, link)
    assert process.wait() == 0
    found = SUMMARY.search(process.output)
    assert found
    sent, count, _, _, past, unread = map(int, found.groups())
    assert count == len(session.imus.due_ns)
    assert sent + past == count
    # On a crowded machine this reader may come too late; what it missed must have been counted.
    assert len(data) + unread == sent * SAMPLE_FRAME_BYTES
    samples = StarParser().parse(data)
    expected = StarParser().parse(b"".join(encode_all(session.imus)))
    assert {sample.node_id for sample in samples} == set(NODES)
    assert set(samples) <= set(expected)
    if unread == 0:
        assert samples == expected[past:]
    assert not link.is_symlink()


def test_a_bad_radio_loses_and_garbles_frames(start_process, folder, session, tmp_path):
    link = tmp_path / "tty"
    start_ns = time.time_ns() + 3_000_000_000
    process = start_process(
        tool("imu_device", folder, "--link", link, "--start-at", start_ns)
        + ["--lost", "0.1", "--corrupted", "0.1"]
    )
    process.wait_for_output("synthetic")
    parser = StarParser()
    parser.parse(read_until_it_ends(process, link))
    parser.finish()
    assert process.wait() == 0
    found = SUMMARY.search(process.output)
    assert found
    sent, count, lost, garbled, past, unread = map(int, found.groups())
    assert count == len(session.imus.due_ns)
    assert 0.08 * count < lost < 0.12 * count
    assert 0.07 * count < garbled < 0.11 * count
    # On a crowded machine some were due before the device or its reader was there.
    missed = past + -(-unread // SAMPLE_FRAME_BYTES)
    assert sent - garbled - missed <= parser.counters["frames"] < 0.88 * count
    assert parser.counters["bytes_skipped"] > 0


def test_started_late_it_skips_what_is_past(start_process, folder, tmp_path):
    start_ns = time.time_ns() - int(60e9)
    process = start_process(
        tool("imu_device", folder, "--link", tmp_path / "tty", "--start-at", start_ns)
    )
    assert process.wait() == 0
    assert " 0 of " in process.output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly_on_a_signal(start_process, folder, tmp_path, number):
    link = tmp_path / "tty"
    start_ns = time.time_ns() + int(600e9)
    process = start_process(tool("imu_device", folder, "--link", link, "--start-at", start_ns))
    process.wait_for_output("synthetic")
    process.signal(number)
    assert process.wait() == 0
    assert "stopped" in process.output
    assert "Traceback" not in process.output
    assert not link.is_symlink()


def test_a_folder_that_is_no_session_is_one_clear_line(start_process, tmp_path):
    process = start_process(tool("imu_device", tmp_path, "--link", tmp_path / "tty"))
    assert process.wait() == 1
    assert process.output.startswith("error: cannot read")
    assert len(process.output.splitlines()) == 1


def test_generate_refuses_an_unknown_choreography_in_one_line(start_process, tmp_path):
    process = start_process(tool("generate", "-o", tmp_path / "s", "--choreography", "moonwalk"))
    assert process.wait() == 1
    assert process.output.startswith("error: unknown choreography 'moonwalk'")
    assert len(process.output.splitlines()) == 1
    assert not (tmp_path / "s").exists()
