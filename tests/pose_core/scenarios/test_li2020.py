import numpy as np
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
from synthetic_body import MODEL, SHAPE, kinematics, motion

from pose_core.baseline_filters.li2020 import ALPHA, Li2020Filter
from pose_core.baseline_filters.measurement_noise import fuse_measurements, measurement_noise

DT = 1.0 / 30.0


def measured(positions, rng, noise=0.01, sensors=2):
    return positions[:, None] + rng.normal(0.0, noise, (len(positions), sensors, 15, 3))


def started(z):
    filtered = Li2020Filter(MODEL, SHAPE)
    assert filtered.start(z[0].mean(axis=0))
    return filtered


def test_the_filter_equals_the_ukf_of_filterpy():
    """Equations (3) to (15) with a Python call a sigma point give the same numbers."""
    rng = np.random.default_rng(10)
    _, dof = motion(4.0, still_s=0.0)
    z = measured(kinematics().pose(dof).positions, rng)
    ours = started(z)
    n = 2 * MODEL.size
    points = MerweScaledSigmaPoints(n, ALPHA, 2.0, 0.0)
    F = np.eye(n) + DT * np.eye(n, k=MODEL.size)
    textbook = UnscentedKalmanFilter(
        n,
        45,
        DT,
        hx=lambda x: ours.kinematics.pose(x[: MODEL.size]).positions.ravel(),
        fx=lambda x, dt: F @ x,
        points=points,
    )
    textbook.x, textbook.P, textbook.Q = ours._mean.copy(), ours._covariance.copy(), ours._Q
    for seen in z[1:8]:
        R_reference = ours.kinematics.R_reference.copy()
        ours.step(DT, seen)
        np.testing.assert_array_equal(ours.kinematics.R_reference, R_reference)
        propagated = points.sigma_points(textbook.x, textbook.P) @ F.T
        textbook.predict()
        textbook.sigmas_f = propagated  # filterpy draws them anew here; the paper goes on with them
        Z = np.array([textbook.hx(x) for x in textbook.sigmas_f])
        u = textbook.Wm @ Z
        variance = textbook.Wc @ (Z - u) ** 2
        noise = measurement_noise(seen.reshape(2, -1), u, variance)
        fused, R = fuse_measurements(seen.reshape(2, -1), noise, u)
        textbook.update(fused, R=np.diag(R))
        np.testing.assert_allclose(ours._mean, textbook.x, atol=1e-8)
        np.testing.assert_allclose(ours._covariance, textbook.P, atol=1e-8)


def test_order_of_the_sensors_is_irrelevant():
    rng = np.random.default_rng(11)
    _, dof = motion(3.0)
    z = measured(kinematics().pose(dof).positions, rng, sensors=3)
    one, other = started(z), started(z)
    for seen in z[1:]:
        one.step(DT, seen)
        other.step(DT, seen[[2, 0, 1]])
    np.testing.assert_allclose(one.dof, other.dof, atol=1e-6)


def test_the_covariance_stays_symmetric_and_positive():
    rng = np.random.default_rng(12)
    _, dof = motion(8.0)
    z = measured(kinematics().pose(dof).positions, rng)
    filtered = started(z)
    for seen in z[1:]:
        filtered.step(DT, seen)
        np.testing.assert_array_equal(filtered._covariance, filtered._covariance.T)
        assert np.linalg.eigvalsh(filtered._covariance)[0] > 0.0


def test_the_filter_is_more_accurate_than_the_mean_of_the_sensors():
    rng = np.random.default_rng(13)
    _, dof = motion(4.0, still_s=10.0)
    positions = kinematics().pose(dof).positions
    z = measured(positions, rng, noise=0.02)
    filtered = started(z)
    errors = []
    for k in range(1, len(z)):
        filtered.step(DT, z[k])
        errors.append(filtered.kinematics.pose(filtered.dof).positions - positions[k])
    of_mean = z.mean(axis=1) - positions
    rms = np.sqrt(np.mean(np.square(errors[30:])))
    assert rms < np.sqrt(np.mean(of_mean[31:] ** 2))


def test_an_outlier_of_one_sensor_has_little_influence():
    rng = np.random.default_rng(14)
    _, dof = motion(3.0, still_s=10.0)
    positions = kinematics().pose(dof).positions
    z = measured(positions, rng, noise=0.005)
    filtered = started(z)
    for seen in z[1:-1]:
        filtered.step(DT, seen)
    wrong = z[-1].copy()
    wrong[1, :] += [0.4, 0.0, 0.0]
    filtered.step(DT, wrong)
    error = filtered.kinematics.pose(filtered.dof).positions - positions[-1]
    assert np.max(np.linalg.norm(error, axis=1)) < 0.06


def test_two_full_turns_of_the_person_are_tracked():
    t = np.arange(300) / 30.0
    dof = np.zeros((len(t), MODEL.size))
    dof[:, 2] = 0.9
    dof[:, 5] = 4.0 * np.pi * t / t[-1]
    positions = kinematics().pose(dof).positions
    z = measured(positions, np.random.default_rng(15), noise=0.005)
    filtered = started(z)
    for k in range(1, len(z)):
        filtered.step(DT, z[k])
        error = filtered.kinematics.pose(filtered.dof).positions - positions[k]
        assert np.median(np.linalg.norm(error, axis=1)) < 0.1


def test_an_occluded_joint_is_predicted_and_reacquired():
    rng = np.random.default_rng(16)
    _, dof = motion(6.0)
    positions = kinematics().pose(dof).positions
    z = measured(positions, rng, noise=0.005)
    z[60:75, :, 5] = np.nan
    filtered = started(z)
    for k in range(1, len(z)):
        innovation = filtered.step(DT, z[k])
        assert np.isnan(innovation[5]) == (60 <= k < 75)
        assert np.all(np.isfinite(filtered.dof))
    error = filtered.kinematics.pose(filtered.dof).positions[5] - positions[-1, 5]
    assert np.linalg.norm(error) < 0.15


def test_axial_rotation_of_a_straight_limb_does_not_wind_up():
    rng = np.random.default_rng(17)
    _, dof = motion(20.0, still_s=2.0)
    for name in ("left_knee_flexion", "left_elbow_flexion"):
        dof[:, MODEL.dof_index[name]] = 0.0
    z = measured(kinematics().pose(dof).positions, rng, noise=0.02)
    filtered = started(z)
    for seen in z[1:]:
        filtered.step(DT, seen)
        for index, name in enumerate(MODEL.angle_names):
            if name.endswith("rotation"):
                lower, upper = MODEL.limits[index]
                assert lower <= filtered.dof[MODEL.dof_index[name]] <= upper
