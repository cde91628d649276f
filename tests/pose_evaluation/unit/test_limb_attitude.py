import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.api import load_body_model
from pose_core.errors import InputError
from pose_evaluation.limb_attitude import limb_roll, segment_rotations

FORWARD = Rotation.from_euler("y", -90.0, degrees=True)  # a hanging limb raised to the front


@pytest.mark.parametrize("turn_deg", [-60.0, 0.0, 35.0])
def test_roll_is_the_turn_about_the_limbs_own_axis(turn_deg):
    axis = -FORWARD.as_matrix()[:, 2]
    turned = Rotation.from_rotvec(np.radians(turn_deg) * axis) * FORWARD
    assert np.degrees(limb_roll(turned.as_matrix()[None]))[0] == pytest.approx(turn_deg)


def test_a_hanging_limb_has_no_roll():
    assert np.isnan(limb_roll(np.eye(3)[None])[0])


def test_a_limb_turns_as_its_degrees_of_freedom_say():
    model = load_body_model("default")
    dof = np.zeros((1, model.size))
    dof[0, model.dof_index["left_shoulder_flexion"]] = np.pi / 2
    found = segment_rotations(model.dof_names, dof, "left_upper_arm")[0]
    np.testing.assert_allclose(found, FORWARD.as_matrix(), atol=1e-12)
    with pytest.raises(InputError, match="no body model has"):
        segment_rotations(("a", "b"), np.zeros((1, 2)), "left_upper_arm")
