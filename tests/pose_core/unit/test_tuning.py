"""The default filter's tuning from a file: honoured, or refused in one line."""

from pathlib import Path

import pytest

from pose_core.api import (
    Counters,
    DefaultEstimator,
    FilterTuning,
    InputError,
    ParameterError,
    Pipeline,
    PipelineParameters,
    load_body_model,
)
from pose_core.body.average_body import neutral_pose
from pose_core.body.shape import shape_of
from pose_core.filter.tuning import load_tuning


def written(tmp_path, text):
    path = tmp_path / "my.yaml"
    path.write_text(text)
    return str(path)


def test_a_file_changes_the_parameters_that_it_names(tmp_path):
    default = FilterTuning()
    found = load_tuning(
        written(
            tmp_path,
            "camera: {stddev: 1e-2}\n"
            "motion: {acceleration: {head: 60}, carried: {trunk: 0}}\n"
            "posture: {waist_stddev: [0.2, 0.3, 0.4]}\n",
        )
    )
    assert found.camera.stddev == 0.01
    assert found.camera.offset_stddev == default.camera.offset_stddev
    assert found.motion.acceleration == {**default.motion.acceleration, "head": 60.0}
    assert found.motion.carried["trunk"] == 0.0
    assert found.posture.waist_stddev == (0.2, 0.3, 0.4)
    assert found.imu == default.imu


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("camera: {stdev: 0.02}", "tuning/camera has stdev, expected some of stddev, "),
        ("cameras: {}", "tuning has cameras, expected some of motion, camera"),
        ("motion: {carried: {tail: 1}}", "tuning/motion/carried has tail, expected some of pelvis"),
        ("camera: 0.02", "tuning/camera is 0.02, expected some of stddev"),
        ("camera: {stddev: 2 cm}", "tuning/camera/stddev is '2 cm', expected a positive number"),
        ("camera: {stddev: -0.02}", "tuning/camera/stddev is -0.02, expected a positive number"),
        ("camera: {offset_memory: 0}", "offset_memory is 0, expected a positive number"),
        ("arm_length: yes", "tuning/arm_length is True, expected a positive number"),
        ("posture: {waist_stddev: [1, 2]}", r"waist_stddev is \[1, 2\], expected 3 positive"),
        ("", "tuning is None, expected some of motion"),
    ],
)
def test_an_unknown_or_impossible_parameter_is_refused_by_name(tmp_path, text, message):
    parameters = PipelineParameters(tuning=written(tmp_path, text))
    with pytest.raises(InputError, match=rf"my\.yaml: .*{message}"):
        Pipeline(parameters)


def test_the_file_is_read_once(tmp_path):
    path = written(tmp_path, "arm_length: 0.9")
    parameters = PipelineParameters(tuning=path)
    make = DefaultEstimator.maker(parameters)
    Path(path).unlink()
    model = load_body_model("default")
    made = make(model, shape_of(model, neutral_pose()), parameters, Counters())
    assert made.tuning.arm_length == 0.9


def test_a_tuning_is_refused_by_estimators_without_the_default_filter(tmp_path):
    path = written(tmp_path, "arm_length: 1.0")
    for estimator in ("li2020", "mean", "zhang2015"):
        with pytest.raises(ParameterError, match=f"not of estimator = {estimator}"):
            Pipeline(PipelineParameters(estimator=estimator, tuning=path))
