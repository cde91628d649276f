"""An IMU that comes back turned is one that restarted, unless the link may have turned itself."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.body.model import load_body_model
from pose_core.filter.imu_state import has_turned, knows_north
from pose_core.filter.layout import make_layout, rotation_column
from pose_core.filter.state import start_state
from pose_core.filter.tuning import FilterTuning
from pose_core.filter.worn_imus import WornImus

MODEL = load_body_model("default")
IMUS = WornImus(MODEL, {})
((_, THIGH),) = IMUS.with_link(("left_thigh",))
THIGH.use.is_aligned = True


def state_with(stddev):
    """A state in which the thigh's rotation has this standard deviation [rad] about each axis."""
    layout = make_layout(len(MODEL.link_names), 0)
    rotations = np.tile(np.eye(3), (layout.links, 1, 1))
    state = start_state(layout, 2, FilterTuning(), np.zeros(0), np.zeros(3), rotations)
    first = rotation_column(THIGH.link)
    state.P[first : first + 3, first : first + 3] = np.eye(3) * stddev**2
    return state


@pytest.mark.parametrize(("degrees", "stddev_deg"), [(50, 2), (90, 20), (90, 60)])
def test_a_turn_that_the_link_may_have_made_is_none_of_the_imu(degrees, stddev_deg):
    measured = Rotation.from_euler("x", degrees, degrees=True).as_matrix()
    assert not has_turned(THIGH, measured, state_with(np.radians(stddev_deg)))


def test_a_turn_by_far_more_than_the_link_may_have_made_is_the_imus():
    measured = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    assert has_turned(THIGH, measured, state_with(np.radians(5.0)))


@pytest.mark.parametrize(
    ("headings", "expected"),
    [((0.1, 0.2, -0.1, 0.0), True), ((0.1, 2.2, -1.9, 3.0), False), ((0.1, 2.2, -1.9), True)],
    ids=["agree", "differ", "too few to tell"],
)
def test_imus_whose_headings_differ_do_not_know_north_whatever_they_say(headings, expected):
    state, imus = state_with(0.1), WornImus(MODEL, {})
    names = ("left_thigh", "right_thigh", "left_shank", "right_shank")
    for (_, worn), heading in zip(imus.with_link(names[: len(headings)]), headings, strict=True):
        worn.use.is_aligned, worn.says_north = True, True
        state.imus.heading[worn.link] = heading
        last = worn
    assert knows_north(last, imus, state) is expected
    last.says_north = False
    assert not knows_north(last, imus, state)
