"""`./pose bench speed`: the textbook filter's numbers, and that the benchmark runs."""

import numpy as np
import pytest

from pose_bench.reference.opensim_ik import OpenSimIk
from pose_bench.speed import PERIOD_S, Scene, exponent, textbook_of
from pose_bench.tools.bench import run
from pose_core.baseline_filters.li2020 import Li2020Filter
from pose_core.body.model import load_body_model
from pose_core.joints import JOINTS


def test_the_textbook_filter_equals_li2020():
    scene = Scene(load_body_model("li2020"), 6)
    fast = Li2020Filter(scene.model, scene.shape)
    fast.start(scene.joints[0])
    plain = textbook_of(scene)
    for frame in range(1, 4):
        seen = scene.seen(frame, 2)
        seen[0, 3] = seen[:, 7] = np.nan
        fast.step(PERIOD_S, seen)
        plain.step(PERIOD_S, seen)
    mean, covariance = fast.state
    np.testing.assert_allclose(plain.ukf.x, mean, atol=1e-6)
    np.testing.assert_allclose(plain.ukf.P, covariance, atol=1e-6)


def test_opensim_finds_the_pose_that_its_markers_show():
    pytest.importorskip("opensim", reason="the package opensim is not installed")
    scene = Scene(load_body_model("li2020"), 10)
    ik = OpenSimIk(scene.model, scene.shape, scene.joints, 1.0 / PERIOD_S)
    for frame in range(1, 10):
        ik.step(frame)
    errors_m = [ik.solver.computeCurrentMarkerError(joint) for joint in JOINTS]
    assert max(errors_m) < 0.01


def test_exponent_of_a_straight_line_through_zero_is_one():
    assert exponent([(0, 0.0), (1, 2.0), (4, 8.0), (8, 16.0)]) == pytest.approx(1.0)


def test_quick_run_writes_a_table(tmp_path, capsys):
    assert run(["speed", "--quick", "-o", str(tmp_path)]) == 0
    assert "default, two Kinects, nine IMUs" in capsys.readouterr().out
    assert (tmp_path / "speed.md").read_text().startswith("# Speed")
