"""IMUs worn by the synthetic body: their samples in a world turned against map (synthetic)."""

import numpy as np
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, extrinsics, kinematics, motion, skeleton_samples

from pose_core.joints import SIDES
from pose_core.streams.samples import ImuSample

LIMBS = ("upper_arm", "forearm", "thigh", "shank")

EVERY_SEGMENT = ("torso", *(f"{side}_{name}" for side in SIDES for name in LIMBS))
IMU_SEGMENTS = ("torso", "left_upper_arm", "left_forearm", "left_thigh", "left_shank")
IMU_NS = 10_000_000
START_NS = 10**18


def imu_samples(t, dof, rng, heading=1.1, segments=IMU_SEGMENTS):
    """Crookedly strapped IMUs in a world turned by ``heading`` (synthetic)."""
    rotations = kinematics().pose(dof).rotations
    times = np.arange(0.0, t[-1], IMU_NS * 1e-9)
    samples = []
    for segment in segments:
        link = MODEL.link_names.index(MODEL.segments[segment])
        alignment = Rotation.from_rotvec(rng.normal(0.0, 0.3, 3))
        nearest = np.minimum(np.searchsorted(t, times), len(t) - 1)
        before = np.maximum(nearest - 1, 0)
        share = np.clip((times - t[before]) * 30.0, 0.0, 1.0)
        first = Rotation.from_matrix(rotations[before, link])
        turn = (first.inv() * Rotation.from_matrix(rotations[nearest, link])).as_rotvec()
        turned = first * Rotation.from_rotvec(share[:, None] * turn)
        sensors = Rotation.from_euler("z", -heading) * turned * alignment
        rates = (sensors[:-1].inv() * sensors[1:]).as_rotvec() / 0.01
        for time, quaternion, rate in zip(times[:-1], sensors.as_quat(), rates, strict=False):
            samples.append(
                ImuSample(
                    stamp_ns=START_NS + round(time * 1e9),
                    segment=segment,
                    orientation=quaternion,
                    orientation_stddev=np.full(3, 0.02),
                    angular_velocity=rate,
                )
            )
    return samples


def moving_wearer(duration_s):
    """Times, degrees of freedom, skeletons and IMUs' samples of somebody who stands, then moves."""
    t, dof = motion(duration_s, lean=0.3)
    positions = kinematics().pose(dof).positions
    skeletons = skeleton_samples(positions, extrinsics(), np.random.default_rng(2), 0.01)
    return t, dof, skeletons, imu_samples(t, dof, np.random.default_rng(5))


def merged(*lists):
    return sorted((sample for each in lists for sample in each), key=lambda s: s.stamp_ns)


def truth_at(estimate, t, dof):
    time = (estimate.stamp_ns - START_NS) * 1e-9
    return np.array([np.interp(time, t, column) for column in dof.T])
