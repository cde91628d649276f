import numpy as np
import pytest
from synthetic_body import MODEL, SHAPE, kinematics, motion, random_dof

from pose_core.body.measurement import PATIENCE_S, BodyMeasurement
from pose_core.body.model import load_body_model
from pose_core.body.shape import (
    BodyShapeError,
    estimate_body_shape,
    load_body_shape,
    save_body_shape,
)
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS, SIDES


def test_the_model_has_the_24_degrees_of_freedom_in_their_fixed_order():
    limb = (
        "shoulder_flexion",
        "shoulder_abduction",
        "shoulder_rotation",
        "elbow_flexion",
        "hip_flexion",
        "hip_abduction",
        "hip_rotation",
        "knee_flexion",
    )
    assert MODEL.dof_names == (
        "pelvis_x",
        "pelvis_y",
        "pelvis_z",
        "pelvis_rotation_x",
        "pelvis_rotation_y",
        "pelvis_rotation_z",
        "neck_flexion",
        "neck_lateral_bending",
        *(f"{side}_{name}" for side in ("left", "right") for name in limb),
    )


def test_an_unknown_model_is_refused_by_name():
    with pytest.raises(InputError, match="no body model 'centipede'"):
        load_body_model("centipede")


def test_bone_lengths_are_estimated_from_noisy_samples():
    rng = np.random.default_rng(6)
    positions = kinematics().pose(random_dof(rng, 40)).positions
    found = estimate_body_shape(MODEL, positions)
    np.testing.assert_allclose(found.offsets, SHAPE.offsets, atol=1e-9)


def test_bone_lengths_are_robust_to_20_percent_outliers():
    rng = np.random.default_rng(7)
    positions = kinematics().pose(random_dof(rng, 100)).positions
    positions += rng.normal(0.0, 0.005, positions.shape)
    positions[::5, JOINT_INDEX["left_knee"]] += [0.0, 0.3, -0.3]
    found = estimate_body_shape(MODEL, positions).bone_lengths()
    assert abs(found["left_knee"] - 0.42) < 0.01
    assert abs(found["left_foot"] - 0.40) < 0.01


def test_a_joint_with_too_few_samples_is_reported():
    positions = kinematics().pose(random_dof(np.random.default_rng(8), 40)).positions
    positions[5:, JOINT_INDEX["right_hand"]] = np.nan
    with pytest.raises(BodyShapeError, match="right_hand was seen whole in 5 samples"):
        estimate_body_shape(MODEL, positions)


LEGS = [JOINT_INDEX[f"{side}_{name}"] for side in SIDES for name in ("knee", "foot")]


def test_legs_that_are_never_seen_take_the_proportions_of_an_average_body():
    positions = kinematics().pose(random_dof(np.random.default_rng(9), 40)).positions
    positions[:, LEGS] = np.nan
    found = estimate_body_shape(MODEL, positions, assume_unseen=True)
    assert found.assumed == ("left_knee", "left_foot", "right_knee", "right_foot")
    seen = np.setdiff1d(np.arange(len(JOINTS)), LEGS)
    np.testing.assert_allclose(found.offsets[seen], SHAPE.offsets[seen], atol=1e-9)
    np.testing.assert_allclose(found.offsets[LEGS], SHAPE.offsets[LEGS], rtol=0.15, atol=1e-9)


def test_a_joint_seen_on_one_side_is_measured_for_both():
    positions = kinematics().pose(random_dof(np.random.default_rng(10), 40)).positions
    positions[:, JOINT_INDEX["right_foot"]] = np.nan
    found = estimate_body_shape(MODEL, positions, assume_unseen=True)
    assert found.assumed == ()
    np.testing.assert_allclose(found.offsets, SHAPE.offsets, atol=1e-9)


def test_a_body_of_unknown_size_is_refused():
    positions = np.full((40, len(JOINTS), 3), np.nan)
    positions[:, :3] = kinematics().pose(random_dof(np.random.default_rng(11), 40)).positions[:, :3]
    with pytest.raises(BodyShapeError, match="seen whole in 0 samples"):
        estimate_body_shape(MODEL, positions, assume_unseen=True)


@pytest.mark.parametrize("unit", [0.1, 3.28])
def test_positions_that_are_not_in_metres_are_refused(unit):
    positions = unit * kinematics().pose(random_dof(np.random.default_rng(8), 40)).positions
    with pytest.raises(BodyShapeError, match="give positions in metres"):
        estimate_body_shape(MODEL, positions, assume_unseen=True)


def measured(measuring, period_ns, positions, states):
    """What a measurement gives after each sample."""
    shapes = []
    for k, (joints, state) in enumerate(zip(positions, states, strict=True)):
        measuring.add(k * period_ns, joints[None], state)
        shapes.append(measuring.shape())
    return shapes


def test_body_measurement_assumes_after_its_patience_what_is_never_seen():
    _, dof = motion(2.0)
    positions = kinematics().pose(dof).positions
    state = np.full((1, 15), 2, np.uint8)
    state[0, LEGS] = 0
    measuring = BodyMeasurement(MODEL, 0.5)
    shapes = measured(measuring, 250_000_000, positions, [state] * len(positions))
    known = [k for k, shape in enumerate(shapes) if shape is not None]
    assert known[0] * 0.25 == pytest.approx(0.5 + PATIENCE_S + 0.25)


def test_body_measurement_waits_for_its_duration_and_for_every_joint():
    _, dof = motion(2.0)
    positions = kinematics().pose(dof).positions
    state = np.full((1, 15), 2, np.uint8)
    unseen = state.copy()
    unseen[0, JOINT_INDEX["head"]] = 1
    measuring = BodyMeasurement(MODEL, 0.5)
    states = [unseen if k < 25 else state for k in range(len(positions))]
    shapes = measured(measuring, 33_000_000, positions, states)
    known = [k for k, shape in enumerate(shapes) if shape is not None]
    assert known[0] == 25 + 10 - 1  # ten samples with the head
    assert "head" in measuring.status


def test_a_body_shape_is_unchanged_by_saving_and_loading(tmp_path):
    path = tmp_path / "me.yaml"
    save_body_shape(path, MODEL, SHAPE, "me")
    np.testing.assert_allclose(load_body_shape(path, MODEL).offsets, SHAPE.offsets, atol=1e-5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is not plain YAML"),
        ("a: 1", "holds no bone lengths"),
        ("{version: 1, body_model: other}", "is for body model other"),
        ("{version: 1, body_model: li2020, offsets: {head: [0, 0, 1]}}", "expected all of head"),
    ],
)
def test_an_invalid_body_shape_file_is_refused_in_one_line(tmp_path, text, message):
    path = tmp_path / "wrong.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        load_body_shape(path, MODEL)
    assert "\n" not in str(caught.value)


def test_a_missing_body_shape_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot read"):
        load_body_shape(tmp_path / "missing.yaml", MODEL)
