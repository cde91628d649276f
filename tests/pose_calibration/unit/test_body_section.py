"""The person's body measures in a session's file."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_calibration.body_measures import measure_body
from pose_calibration.files.extrinsics_file import load_extrinsics, save_extrinsics
from pose_core.errors import InputError
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.joints import JOINT_INDEX


@pytest.fixture(scope="module")
def body():
    _, dof = motion(3.0)
    positions = kinematics().pose(dof).positions
    return measure_body(skeleton_samples(positions, extrinsics(), np.random.default_rng(1), 0.005))


@pytest.fixture
def path(body, tmp_path):
    path = tmp_path / "session.yaml"
    save_extrinsics(path, replace(extrinsics(), body=body))
    return path


def test_a_neutral_stand_gives_the_bones_to_a_centimetre(body):
    lengths = body.shape.bone_lengths()
    assert lengths["left_knee"] == pytest.approx(0.42, abs=0.01)
    assert lengths["right_elbow"] == pytest.approx(0.30, abs=0.01)


def test_a_session_without_a_person_has_no_body_measures():
    assert measure_body([]) is None


def test_measures_survive_the_file(body, path):
    loaded = load_extrinsics(path).body
    assert loaded.model == body.model
    np.testing.assert_allclose(loaded.shape.offsets, body.shape.offsets, atol=1e-5)
    document = yaml.safe_load(path.read_text())
    assert document["body"]["bone_lengths"]["left_knee"] == pytest.approx(0.42, abs=0.01)


def test_the_fusion_uses_them_from_the_start(path):
    placed = load_extrinsics(path)
    pipeline = Pipeline(PipelineParameters(), placed)
    assert pipeline.status == "tracking"
    np.testing.assert_array_equal(pipeline.shape.offsets, placed.body.shape.offsets)


def test_measures_of_another_body_model_are_left_alone(path):
    pipeline = Pipeline(PipelineParameters(estimator="li2020"), load_extrinsics(path))
    assert pipeline.shape is None


def no_mapping(document):
    document["body"] = 1.75
    return "'body' is 1.75, expected a mapping"


def unknown_model(document):
    document["body"]["body_model"] = "octopus"
    return "body/body_model is 'octopus': found no body model 'octopus'"


def joint_missing(document):
    del document["body"]["offsets"]["head"]
    return "body/offsets has .* expected all of head"


def giant(document):
    document["body"]["offsets"]["left_knee"] = [0.0, 0.0, -4.3]
    return r"body/offsets/left_knee is \[0.0, 0.0, -4.3\], expected three numbers within ±1 m"


@pytest.mark.parametrize(
    "change", [no_mapping, unknown_model, joint_missing, giant], ids=lambda c: c.__name__
)
def test_a_wrong_section_is_refused_with_what_is_wrong(change, path):
    document = yaml.safe_load(path.read_text())
    message = change(document)
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(InputError, match=message):
        load_extrinsics(path)


def test_every_joint_is_measured(body):
    assert np.isfinite(body.shape.offsets).all()
    assert np.linalg.norm(body.shape.offsets[JOINT_INDEX["head"]]) > 0.1
