"""Two segments that a joint connects, as IMUs on them feel their motion (synthetic)."""

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from pose_core.streams.samples import ImuBlock

START_NS = 10**18
RATE = 100.0  # [Hz]
GRAVITY = np.array([0.0, 0.0, 9.81])
PLACES = {  # [m] of the joint in the sensors' frames
    "left_thigh": np.array([0.03, -0.06, -0.2]),
    "left_shank": np.array([-0.02, 0.05, 0.15]),
}
SAMPLED_S = {"left_thigh": 0.0, "left_shank": 0.0037}  # [s] each by its own clock


def swings(rng, t, size):
    """Three smooth angles or coordinates that come and go within one to four seconds."""
    frequencies, phases = rng.uniform(0.25, 1.0, (2, 3)), rng.uniform(0.0, 6.0, (2, 3))
    waves = np.sin(2.0 * np.pi * frequencies * t[:, None, None] + phases)
    return size * waves.sum(axis=1)


def jointed_imus(turns, duration_s=60.0, seed=1, noise=0.0, gravity=GRAVITY):
    """Samples of two IMUs on either side of a knee.

    Args:
        turns: Headings of their worlds in map [rad], by segment: numbers or functions of time [s].
        duration_s: How long.
        seed: Of the motion and the noise.
        noise: Of each axis of the accelerometers, from sample to sample [m/s²].
        gravity: What they feel at rest, in map [m/s²], (3,).

    Returns:
        A block in the order of its stamps.
    """
    rng = np.random.default_rng(seed)
    fine = np.arange(0.0, duration_s + 0.02, 0.005)
    joint = swings(rng, fine, 0.08)
    parts = []
    for number, (segment, place) in enumerate(PLACES.items()):
        t = np.arange(SAMPLED_S[segment], duration_s, 1.0 / RATE)
        angles = swings(rng, fine, 0.4)
        turned = Rotation.from_euler("ZYX", angles)
        path = make_interp_spline(fine, joint - turned.apply(place), k=5)
        R_map = Rotation.from_euler("ZYX", make_interp_spline(fine, angles, k=5)(t))
        felt = R_map.inv().apply(path(t, 2) + gravity)
        turn = turns[segment]
        heading = turn(t) if callable(turn) else np.full(len(t), turn)
        R_world = Rotation.from_rotvec(-heading[:, None] * [0.0, 0.0, 1.0]) * R_map
        parts.append((number, t, R_world.as_quat(), felt + noise * rng.normal(size=felt.shape)))
    times = np.concatenate([part[1] for part in parts])
    order = np.argsort(times, kind="stable")
    count = len(times)
    return ImuBlock(
        segments=tuple(PLACES),
        imu=np.concatenate([np.full(len(t), n) for n, t, _, _ in parts])[order],
        stamps_ns=START_NS + np.rint(times[order] * 1e9).astype(np.int64),
        orientation=np.concatenate([q for _, _, q, _ in parts])[order],
        orientation_stddev=np.full((count, 3), 0.02),
        angular_velocity=np.zeros((count, 3)),
        linear_acceleration=np.concatenate([f for _, _, _, f in parts])[order],
    )
