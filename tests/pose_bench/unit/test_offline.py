"""The repeated bags of ``./pose bench offline``, and the figures of ``live`` from its probe."""

import sys

import numpy as np
import pytest
from session_bag import write_session
from synthetic_body import FRAME_NS, extrinsics, kinematics, motion, skeleton_samples

from pose_bench.live_run import _result
from pose_bench.processes import Usages
from pose_bench.tools import offline
from pose_bench.tools.bench import run
from pose_bench.tools.offline import PAUSE_NS, repeat
from pose_core.errors import InputError
from pose_io.bag_samples import BagSamples
from pose_io.bags import open_bag

S = 10**9
HOLDING = 50 * 10**6  # [bytes] that each of two processes fills


@pytest.fixture(scope="module")
def short_bag(tmp_path_factory):
    _, dof = motion(2.0)
    samples = skeleton_samples(kinematics().pose(dof).positions, extrinsics())
    path = tmp_path_factory.mktemp("bag") / "short"
    write_session(path, samples)
    return path, samples


def test_a_repeated_bag_goes_on_where_it_ended(short_bag, tmp_path):
    path, samples = short_bag
    with open_bag(path) as bag:
        duration_s = repeat(bag, tmp_path / "long", 3)
    with open_bag(tmp_path / "long") as bag:
        found = list(BagSamples(bag))
    period_ns = round(duration_s * 1e9 / 3)
    span_ns = samples[-1].stamp_ns - samples[0].stamp_ns
    assert period_ns == pytest.approx(span_ns + PAUSE_NS, abs=FRAME_NS)
    expected = [s.stamp_ns + turn * period_ns for turn in range(3) for s in samples]
    assert [each.stamp_ns for each in found] == expected
    np.testing.assert_array_equal(found[-1].positions, found[len(samples) - 1].positions)


def arrivals(states):
    return {str(S + k * 10_000_000): S + k * 10_000_000 + 3_000_000 for k in range(states)}


STAGES = {"to_the_output": "4.0, p99 9.0"}


USAGES = (
    Usages(at_s=0.0, cpu_s={"fusion": 1.0}, memory_mb={"fusion": 90.0}),
    Usages(at_s=10.0, cpu_s={"fusion": 3.0}, memory_mb={"fusion": 100.0}),
)


def test_latency_and_load_come_from_the_arrivals_and_the_usages():
    result = _result(arrivals(20), STAGES, S, *USAGES)
    np.testing.assert_allclose(result.latency_ms, 3.0)
    assert result.missing == 0
    assert result.load == {"fusion": pytest.approx(0.2)}
    assert result.memory_mb == {"fusion": 100.0}


def test_an_instant_without_a_joint_state_is_counted():
    arrived = arrivals(20)
    del arrived[str(S + 90_000_000)]
    assert _result(arrived, STAGES, S, *USAGES).missing == 1


def test_a_graph_without_output_is_an_error():
    with pytest.raises(InputError, match="no joint states"):
        _result({}, STAGES, S, *USAGES)


def test_a_prediction_is_nearer_to_now_than_the_last_output(tmp_path):
    words = ["prediction", "--choreographies", "kicks", "--duration", "20", "-o", str(tmp_path)]
    assert run(words) == 0
    rows = (tmp_path / "prediction.md").read_text().splitlines()
    rows = [line.split("|") for line in rows if line.startswith("| kicks")]
    assert len(rows) == 2
    assert all(float(row[4]) < 1.2 for row in rows)  # what is published is predicted already


@pytest.fixture
def tool(tmp_path, monkeypatch):
    """Has a script of Python take the place of ``fuse``."""

    def replace_tool(lines):
        path = tmp_path / "tool"
        path.write_text("\n".join([f"#!{sys.executable}", "import os, sys, time", *lines]))
        path.chmod(0o755)
        monkeypatch.setattr(offline, "executable", lambda *_: path)

    return replace_tool


def test_memory_and_time_are_those_of_a_process_and_its_children(tool):
    fill = f"held = bytearray(os.urandom(1) * {HOLDING})"
    tool(
        [
            "child = os.fork()",
            fill,
            "while time.process_time() < 1.0: pass",
            "if child: os.waitpid(child, 0)",
        ]
    )
    _, cpu_s, memory_mb = offline._fused("in", "out")
    assert memory_mb > 2 * HOLDING * 1e-6
    assert cpu_s >= 2.0


def test_a_tool_that_fails_is_an_error(tool):
    tool(["sys.exit(1)"])
    with pytest.raises(InputError, match="fuse failed on in"):
        offline._fused("in", "out")
