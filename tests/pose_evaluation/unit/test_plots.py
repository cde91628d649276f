import subprocess
import sys

import numpy as np
import pytest
from moving_body import motion

from pose_core.body.joint_angles import ANGLES
from pose_core.errors import InputError
from pose_evaluation.plots import (
    angles_figure,
    bone_lengths_figure,
    errors_figure,
    save_figure,
    style_of,
)
from pose_evaluation.scores import evaluate
from pose_io.references.reference import reference_of_skeleton

METHODS = ("left", "right", "mean", "reference", "fused")


@pytest.fixture
def series():
    return {name: motion(rate=30.0) for name in METHODS}


def texts(figure):
    return [axes.get_title(loc="left") for axes in figure.axes]


def line(figure, plot, name):
    lines = figure.axes[plot].get_lines()
    return next(each for each in lines if each.get_label() == name)


def test_every_angle_has_a_plot_with_every_method_and_a_unit(series):
    figure = angles_figure("synthetic subject", series)
    assert sorted(texts(figure)) == sorted(angle.replace("_", " ") for angle in ANGLES)
    for axes in figure.axes:
        assert [each.get_label() for each in axes.get_lines()] == list(METHODS)
        assert axes.get_ylabel() == "[deg]"
    assert "time [s]" in {axes.get_xlabel() for axes in figure.axes}
    assert figure.get_suptitle() == "synthetic subject"


def test_a_plot_shows_degrees_over_seconds_from_the_beginning(series):
    figure = angles_figure("", series)
    index = texts(figure).index("right shoulder flexion")
    times, degrees = line(figure, index, "fused").get_data()
    assert (times[0], times[-1]) == pytest.approx((0.0, 12.0), abs=0.05)
    assert np.max(degrees) == pytest.approx(np.degrees(2.0), abs=0.5)


def test_a_line_is_broken_at_a_gap(series):
    whole = series["left"]
    keep = (whole.stamps_ns < 4e9) | (whole.stamps_ns > 6e9)
    series["left"] = type(whole)(
        stamps_ns=whole.stamps_ns[keep],
        positions=whole.positions[keep],
        tracking_state=whole.tracking_state[keep],
    )
    figure = angles_figure("", series)
    assert np.isnan(line(figure, 0, "left").get_ydata()).sum() == 1
    assert np.isnan(line(figure, 0, "right").get_ydata()).sum() == 0


def test_bone_lengths_are_shown_in_centimetres(series):
    figure = bone_lengths_figure("", series)
    thigh = line(figure, texts(figure).index("left thigh (left hip to left knee)"), "fused")
    assert thigh.get_ydata() == pytest.approx(45.0)


def test_the_error_plot_says_synthetic_and_has_a_bar_for_each_angle_and_the_mean():
    truth = reference_of_skeleton("the truth", motion(), synthetic=True)
    evaluation = evaluate({"left": motion(rate=30.0)}, truth)
    (axes,) = errors_figure(evaluation).axes
    assert "simulated sensors" in axes.get_title(loc="left")
    assert len(axes.patches) == len(ANGLES) + 1
    assert axes.get_ylabel() == "RMSE [deg]"


def test_no_two_methods_share_a_colour():
    names = ("left", "right", "top", "back", "mean", "reference", "fused")
    assert len({style_of(name, names)[0] for name in names}) == len(names)


def test_the_same_figure_gives_the_same_bytes(tmp_path, series):
    for name in ("one.png", "two.png"):
        save_figure(bone_lengths_figure("bones", series), tmp_path / "plots" / name)
    one, two = sorted((tmp_path / "plots").iterdir())
    assert one.read_bytes() == two.read_bytes()
    assert one.read_bytes().startswith(b"\x89PNG")


def test_nothing_to_plot_is_said():
    with pytest.raises(InputError, match="nothing to plot"):
        angles_figure("", {"left": motion().between(-2, -1)})


def test_a_folder_that_cannot_be_written_is_said(tmp_path, series):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write"):
        save_figure(bone_lengths_figure("", series), tmp_path / "file" / "plot.png")


def test_plotting_does_not_import_pyplot():
    code = "import sys, pose_evaluation.plots; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
