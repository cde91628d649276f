import contextlib
import os
import pty
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import yaml
from ament_index_python.packages import get_package_prefix
from patience import PATIENCE_S
from skeleton_bag import write_bag
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_calibration.session_calibration import complete
from pose_core.body.model import load_body_model
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_fusion.tools import fuse
from pose_io.bags import open_bag

BODY = "/humans/bodies/subject"
FUSE = f"{get_package_prefix('pose_fusion')}/lib/pose_fusion/fuse"


def run_fuse(*arguments):
    return subprocess.run(
        [FUSE, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )


@pytest.fixture(scope="module")
def samples():
    _, dof = motion(12.0)
    positions = kinematics().pose(dof).positions
    return skeleton_samples(positions, extrinsics(), np.random.default_rng(50), 0.005)


@pytest.fixture(scope="module")
def bag(samples, tmp_path_factory):
    path = tmp_path_factory.mktemp("fuse") / "in"
    write_bag(path, samples)
    return path


def messages(path):
    with open_bag(path) as opened:
        return [(m.topic, m.stamp_ns, bytes(m.data)) for m in opened.messages()]


@pytest.fixture(scope="module")
def fused(bag, tmp_path_factory):
    """The fused bag; the file of body measures that was saved with it lies beside."""
    folder = tmp_path_factory.mktemp("fused")
    result = run_fuse(bag, folder / "out", "--shape-file", folder / "me.yaml")
    assert result.returncode == 0, result.stderr
    return folder / "out"


def test_fusing_twice_gives_identical_bytes_of_messages(bag, fused, tmp_path):
    assert run_fuse(bag, tmp_path / "again").returncode == 0
    one = messages(fused)
    assert one == messages(tmp_path / "again")
    assert {topic for topic, _, _ in one} == {
        f"{BODY}/joint_states",
        f"{BODY}/skeleton",
        f"{BODY}/estimate",
        f"{BODY}/markers",
        f"{BODY}/urdf",
        "/tf",
        "/tf_static",
        "/diagnostics",
    }


def test_joint_states_of_the_bag_equal_those_of_the_pipeline(fused, samples):
    with open_bag(fused) as opened:
        states = [opened.deserialize(m) for m in opened.messages([f"{BODY}/joint_states"])]
    pipeline = Pipeline(PipelineParameters(), complete([[one] for one in samples], extrinsics()))
    expected = [e for sample in samples for e in pipeline.add(sample)] + pipeline.flush()
    assert len(states) == len(expected)
    assert tuple(states[0].name) == load_body_model("default").angle_names
    np.testing.assert_allclose(states[-1].position, expected[-1].position[6:], atol=1e-6)


def test_a_bag_without_extrinsics_is_calibrated_from_its_motion_and_reported(samples, tmp_path):
    write_bag(tmp_path / "in", samples, with_extrinsics=False)
    result = run_fuse(tmp_path / "in", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    assert "estimating them from its motion" in result.stderr
    with open_bag(tmp_path / "out") as opened:
        static = [opened.deserialize(m) for m in opened.messages(["/tf_static"])]
    frames = {t.child_frame_id for t in static[0].transforms}
    assert frames == {"kinect_left_optical_frame", "kinect_right_optical_frame"}


def test_a_terminal_shows_what_is_being_done_from_the_start(samples, tmp_path):
    write_bag(tmp_path / "in", samples, with_extrinsics=False)
    terminal, other_end = pty.openpty()
    process = subprocess.Popen([FUSE, tmp_path / "in", tmp_path / "out"], stderr=other_end)
    os.close(other_end)
    shown = b""
    with contextlib.suppress(OSError):  # the end of the process closes the terminal
        while read := os.read(terminal, 4096):
            shown += read
    os.close(terminal)
    assert process.wait(PATIENCE_S) == 0
    places = [shown.index(word) for word in (b"reading", b"calibrating", b"fusing")]
    assert places == sorted(places)


def test_clocks_that_the_bag_does_not_give_are_found_from_its_motion(samples, fused, tmp_path):
    ahead = [
        replace(one, stamp_ns=one.stamp_ns + 150_000_000) if one.sensor == "right" else one
        for one in samples
    ]
    write_bag(tmp_path / "in", sorted(ahead, key=lambda one: one.stamp_ns))
    result = run_fuse(tmp_path / "in", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    assert "clocks: ahead of left's by the motion in the bag: right +15" in result.stderr
    # The same motion as with equal clocks.
    bodies = [angles(path) for path in (fused, tmp_path / "out")]
    assert np.degrees(np.abs(bodies[0][-400:] - bodies[1][-400:])).mean() < 1.5


def angles(path):
    with open_bag(path) as opened:
        states = [opened.deserialize(m) for m in opened.messages([f"{BODY}/joint_states"])]
    return np.array([state.position for state in states])


def test_parameters_come_from_a_file_and_from_options(bag, tmp_path):
    params = tmp_path / "params.yaml"
    params.write_text("fusion: {ros__parameters: {subject: anna, shape_duration: 4.0}}")
    result = run_fuse(bag, tmp_path / "out", "--params", params, "--subject", "berta")
    assert result.returncode == 0, result.stderr
    topics = {topic for topic, _, _ in messages(tmp_path / "out")}
    assert "/humans/bodies/berta/joint_states" in topics


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{tmp}/missing", "{tmp}/out"], "found no bag"),
        (["{bag}", "{bag}"], "exists already"),
        (["{bag}", "{tmp}/out", "--sensors", "left", "middle"], "no skeletons of middle"),
        (["{bag}", "{tmp}/out", "--forget-after", "-1"], "forget_after"),
        (["{bag}", "{tmp}/out", "--extrinsics-file", "{tmp}/no.yaml"], "no.yaml"),
        (["{bag}", "{tmp}/out", "--tuning", "{tmp}/no.yaml"], "no.yaml"),
    ],
)
def test_bad_input_is_reported_in_one_line_and_leaves_no_output(
    bag, tmp_path, monkeypatch, capsys, arguments, message
):
    words = [a.format(tmp=tmp_path, bag=bag) for a in arguments]
    monkeypatch.setattr(sys, "argv", ["fuse", *words])
    with pytest.raises(SystemExit) as ended:
        fuse.main()
    assert ended.value.code == 1
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert message in errors[0]
    assert list(tmp_path.iterdir()) == []


def test_a_bag_without_skeletons_is_refused(fused, tmp_path):
    result = run_fuse(fused, tmp_path / "again")
    assert result.returncode == 1
    assert "holds no skeletons" in result.stderr


def test_the_body_shape_is_saved_and_reused(bag, fused, tmp_path):
    measures = fused.with_name("me.yaml")
    assert "left_knee" in measures.read_text()
    result = run_fuse(bag, tmp_path / "two", "--shape-file", measures)
    assert result.returncode == 0, result.stderr
    longer = yaml.safe_load(measures.read_text())
    longer["offsets"] = {k: [1.1 * x for x in v] for k, v in longer["offsets"].items()}
    (tmp_path / "longer.yaml").write_text(yaml.safe_dump(longer))
    result = run_fuse(bag, tmp_path / "long", "--shape-file", tmp_path / "longer.yaml")
    assert result.returncode == 0, result.stderr
    assert thigh(tmp_path / "two") == pytest.approx(thigh(fused), abs=0.002)
    assert thigh(tmp_path / "long") > 1.03 * thigh(fused)


def thigh(path):
    """Mean length of the left thigh in a fused bag [m]."""
    with open_bag(path) as opened:
        every = [opened.deserialize(m) for m in opened.messages([f"{BODY}/skeleton"])]
    rows = [every[0].name.index(f"left_{joint}") for joint in ("hip", "knee")]
    ends = np.array([[(p.x, p.y, p.z) for p in np.array(one.position)[rows]] for one in every])
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean()
