"""The drawn body: its parts fit the measured joints, its joints' balls show the source."""

from collections import Counter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_body import SHAPE
from viewed_bag import moving_joints

from pose_core.joints import JOINT_INDEX, LIMB_ENDS, TrackingState
from pose_core.kernels.published_state import Source
from pose_view.body.joint_marks import BALLS, COLORS, joint_marks, make_balls
from pose_view.body.measures import MeasuredBody, measure
from pose_view.body.parts import PARTS, make_parts
from pose_view.body.poses import part_poses, quaternions
from pose_view.mesh import ellipsoid, loft
from pose_view.snapshot import BodySnapshot, DofSnapshot

JOINTS = moving_joints(6.0)[::10]
MEASURES = measure(JOINTS)


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.sum(a * np.cross(b, c)) / 6.0


def edges(mesh):
    pairs = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return Counter(map(tuple, pairs.tolist()))


def body(state=TrackingState.TRACKED, **dof):
    values = {"stddev": 0.01, "weight_imu": 0.0, "source": Source.KINECT, **dof}
    names = tuple({name for ball in BALLS.values() for name in ball.dof})
    return BodySnapshot(
        stamp_ns=0,
        joints=JOINTS[0],
        tracking_state=np.full(15, state, np.uint8),
        dof=DofSnapshot(
            names=names,
            position=np.zeros(len(names)),
            stddev=np.full(len(names), values["stddev"]),
            weight_imu=np.full(len(names), values["weight_imu"]),
            source=np.full(len(names), values["source"], np.uint8),
            latency_s=0.01,
        ),
    )


SURFACES = {
    "ellipsoid": ellipsoid((0.1, 0.2, 0.3)),
    "loft": loft([(0.0, 0.1, 0.2), (1.0, 0.2, 0.1, 0.05)]),
    **make_parts(MEASURES),
    **{f"ball of {joint}": mesh for joint, mesh in make_balls(MEASURES).items()},
}


@pytest.mark.parametrize("name", SURFACES)
def test_every_surface_is_closed_and_faces_outward(name):
    mesh = SURFACES[name]
    counts = edges(mesh)

    assert all(counts[b, a] == count for (a, b), count in counts.items())
    assert volume(mesh) > 0.0


def test_an_ellipsoid_has_its_volume():
    assert volume(ellipsoid((0.1, 0.2, 0.3))) == pytest.approx(4 / 3 * np.pi * 0.006, rel=0.06)


def test_the_measures_are_the_bodys_own():
    assert MEASURES.thigh == pytest.approx((0.42, 0.42))
    assert MEASURES.forearm == pytest.approx((0.28, 0.28))
    assert MEASURES.hips == pytest.approx(0.18)
    assert MEASURES.neck == pytest.approx(np.linalg.norm(SHAPE.offsets[JOINT_INDEX["head"]]))


def test_a_body_is_drawn_anew_only_when_its_measures_change():
    measured = MeasuredBody()
    same = [measured.add(JOINTS[0]) for _ in range(100)]
    other = [measured.add(1.1 * JOINTS[0]) for _ in range(100)]

    assert sum(same) == 1
    assert sum(other) == 1
    assert measured.measures.thigh == pytest.approx((0.462, 0.462))


@pytest.mark.parametrize("frame", range(0, len(JOINTS), 3))
def test_every_limb_reaches_from_its_joint_to_the_next(frame):
    positions, rotations = part_poses(JOINTS[frame])

    for part in PARTS:
        if part not in LIMB_ENDS:
            continue
        side, _, limb = part.partition("_")
        start, end = (JOINTS[frame, JOINT_INDEX[joint]] for joint in LIMB_ENDS[part])
        index = PARTS.index(part)
        length = getattr(MEASURES, limb)[0 if side == "left" else 1]
        np.testing.assert_allclose(positions[index], start)
        tip = positions[index] + rotations[index] @ [0.0, 0.0, -length]
        np.testing.assert_allclose(tip, end, atol=1e-6)


def test_all_parts_have_proper_rotations_and_their_quaternions():
    _, rotations = part_poses(JOINTS[7])

    assert rotations @ rotations.transpose(0, 2, 1) == pytest.approx(
        np.tile(np.eye(3), (len(PARTS), 1, 1))
    )
    found = Rotation.from_quat(np.roll(quaternions(rotations), -1, axis=1))
    assert (found * Rotation.from_matrix(rotations).inv()).magnitude() == pytest.approx(0, abs=1e-7)


def test_a_limbs_turn_about_itself_is_that_of_its_link():
    _, plain = part_poses(JOINTS[5])
    index = PARTS.index("right_forearm")
    turned = plain[index] @ Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix()

    _, found = part_poses(JOINTS[5], {"right_forearm": turned})

    assert found[index] == pytest.approx(turned, abs=1e-6)


def test_an_arm_straight_up_has_a_rotation_too():
    joints = JOINTS[0].copy()
    shoulder = joints[JOINT_INDEX["left_shoulder"]]
    up = joints[JOINT_INDEX["neck"]] - joints[JOINT_INDEX["torso"]]
    up /= np.linalg.norm(up)
    joints[JOINT_INDEX["left_elbow"]] = shoulder + 0.3 * up
    joints[JOINT_INDEX["left_hand"]] = shoulder + 0.58 * up

    _, rotations = part_poses(joints)

    assert rotations[PARTS.index("left_upper_arm")] @ [0, 0, -1] == pytest.approx(up)


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (body(), "tracked"),
        (body(TrackingState.INFERRED), "inferred"),
        (body(weight_imu=0.8, source=Source.FUSED), "imu"),
        (body(TrackingState.NOT_TRACKED, weight_imu=1.0, source=Source.IMU), "imu"),
        (body(source=Source.PREDICTED), "predicted"),
        (body(TrackingState.NOT_TRACKED), "predicted"),
    ],
)
def test_a_joints_colour_shows_its_source(shown, expected):
    assert {mark.color for mark in joint_marks(shown).values()} == {COLORS[expected]}


def test_an_uncertain_joint_is_paler_and_larger():
    certain, doubtful = (
        joint_marks(body(stddev=stddev))["left_knee"] for stddev in (0.01, np.radians(20.0))
    )

    assert min(doubtful.color) > min(certain.color)
    assert doubtful.growth > certain.growth == 1.0


def test_a_body_without_an_estimate_is_coloured_by_its_tracking_states():
    shown = BodySnapshot(
        stamp_ns=0, joints=JOINTS[0], tracking_state=np.full(15, TrackingState.INFERRED, np.uint8)
    )
    assert joint_marks(shown)["left_knee"].color == COLORS["inferred"]
