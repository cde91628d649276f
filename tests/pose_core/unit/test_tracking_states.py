"""The tracking states of estimated joints, against the equation in plain numpy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL

from pose_core.body.kinematics import model_arrays
from pose_core.joints import JOINTS
from pose_core.kernels.published_state import PublishedState
from pose_core.kernels.tracking_states import tracking_states

POSES, LINKS = 40, len(MODEL.link_names)


@pytest.fixture
def body():
    return model_arrays(MODEL, np.random.default_rng(1).normal(0.0, 0.3, (len(JOINTS), 3)))


@pytest.fixture
def states():
    rng = np.random.default_rng(2)
    spread = rng.normal(0.0, 0.2, (POSES, LINKS, 3, 3))
    return PublishedState(
        position=np.zeros((POSES, 3)),
        velocity=np.zeros((POSES, 3)),
        rotations=Rotation.random(POSES * LINKS, rng).as_matrix().reshape(POSES, LINKS, 3, 3),
        rates=np.zeros((POSES, LINKS, 3)),
        joints=np.zeros((POSES, len(JOINTS), 3)),
        position_variance=rng.uniform(0.0, 0.01, (POSES, 3)),
        covariance=spread
        @ spread.swapaxes(-1, -2)
        * rng.choice([0.01, 0.1, 1.0], (POSES, 1, 1, 1)),
        information=rng.uniform(0.0, 0.5, (POSES, 2, LINKS, 3, 3)),
        scale=rng.uniform(0.5, 3.0, (POSES, 1)),
        ahead_s=np.zeros((POSES, 1)),
    )


def stddev(body, states, row, joint):
    """Of one joint [m]: the sum over the chain from its link to the root."""
    variance, link = states.position_variance[row].sum(), int(body.link_of_joint[joint])
    while link >= 0:
        chain, above = np.zeros((3, 3)), link
        while above >= 0:
            chain, above = chain + states.covariance[row, above], int(body.parents[above])
        p = states.rotations[row, link] @ body.offsets[joint]
        variance += np.trace(chain) * (p @ p) - p @ chain @ p
        joint = int(body.pivot_joints[link])
        link = int(body.link_of_joint[joint]) if joint >= 0 else -1
    return np.sqrt(variance * states.scale[row, 0])


def test_a_joint_is_tracked_if_it_is_certain_and_its_link_is_measured(body, states):
    found = np.empty((POSES, len(JOINTS)), np.uint8)
    tracking_states(body, states, found)
    for row in range(POSES):
        for joint in range(len(JOINTS)):
            link = body.link_of_joint[joint]
            is_measured = np.trace(states.information[row, :, link].sum(axis=0)) > 1.0
            size = stddev(body, states, row, joint)
            expected = 2 if size <= 0.25 and is_measured else 1 if size <= 0.6 else 0
            assert found[row, joint] == expected
    assert set(np.unique(found)) == {0, 1, 2}
