import numpy as np
from scipy.spatial.transform import Rotation

from pose_fusion.imu.strapping import StrappingEstimator

STEP_S = 0.033
MOUNTING = Rotation.from_rotvec([0.3, -0.2, 0.25])  # R_sensor_segment, 25 degrees crooked


def refined(angles, *, with_hinge=True, noise=0.0, outliers=0.0, heading_error=0.0):
    """What is found after a motion: Euler angles (n, 3) [rad] about the segment's z, y, x."""
    rng = np.random.default_rng(3)
    estimator = StrappingEstimator(np.eye(3))
    for row in angles:
        segment = Rotation.from_euler("ZYX", row)
        sensor = (Rotation.from_euler("z", heading_error) * segment * MOUNTING.inv()).as_matrix()
        error = Rotation.from_rotvec(rng.normal(size=3) * noise)
        if rng.uniform() < outliers:
            error = Rotation.from_rotvec(rng.normal(size=3))
        seen = (error * segment).as_matrix()
        estimator.observe_long_axis(STEP_S, sensor, seen[:, 2])
        if with_hinge:
            estimator.observe_lateral_axis(STEP_S, sensor, seen[:, 1], 0.5)
    return estimator.result


def swinging(count=900):
    t = np.arange(count) * STEP_S
    return np.stack([0.5 * np.sin(0.4 * t), np.sin(1.3 * t), 0.4 * np.sin(0.9 * t)], axis=1)


def errors_deg(result):
    found = Rotation.from_matrix(result.R_sensor_segment)
    return np.degrees((found.inv() * MOUNTING).as_rotvec())


def test_a_crooked_strap_is_found_to_three_degrees_about_all_axes_that_move():
    """Synthetic: noise of 4 degrees, one frame in thirty wrong, heading off by 4 degrees."""
    result = refined(
        swinging(), noise=np.radians(4.0), outliers=1 / 30, heading_error=np.radians(4.0)
    )
    assert np.all(np.abs(errors_deg(result)) < 3.0)
    assert np.all(result.is_observed)


def test_without_a_hinge_an_upright_segments_turn_about_itself_is_called_unknown():
    turning = np.stack([swinging()[:, 0], *np.zeros((2, 900))], axis=1)
    result = refined(turning, with_hinge=False)
    assert result.is_observed.tolist() == [True, True, False]
    assert np.all(np.abs(errors_deg(result)[:2]) < 3.0)


def test_what_nobody_has_seen_is_unknown():
    result = StrappingEstimator(np.eye(3)).result
    assert not result.is_observed.any()
    assert np.isnan(result.residual)


def test_the_residual_tells_a_sensor_that_turns_with_another_segment():
    right = refined(swinging(), noise=np.radians(4.0))
    estimator, thigh, other = StrappingEstimator(np.eye(3)), swinging(), swinging()[::-1]
    for row, elsewhere in zip(thigh, other, strict=True):
        sensor = (Rotation.from_euler("ZYX", elsewhere) * MOUNTING.inv()).as_matrix()
        seen = Rotation.from_euler("ZYX", row).as_matrix()
        estimator.observe_long_axis(STEP_S, sensor, seen[:, 2])
    assert estimator.result.residual > 2.0 * right.residual
