"""A session of the synthetic subject: the motion, and what every virtual sensor makes of it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pose_sim.choreography import compose
from pose_sim.kinect_noise import KinectParameters
from pose_sim.motion import Motion
from pose_sim.scene import SceneParameters, sensor_poses, subject_place
from pose_sim.virtual_kinect import KinectFrames, draw_body_bias, observe

KINECT_STREAM = 2  # which of the seed's random streams feeds the Kinects


@dataclass(frozen=True, kw_only=True)
class Session:
    """A motion and the sensors' view of it."""

    motion: Motion
    sensor_poses: Mapping[str, np.ndarray]  # T_map_kinect_<name>_optical_frame, (4, 4)
    kinects: Mapping[str, KinectFrames]


def make_session(
    choreography: str,
    duration: float,
    seed: int,
    scene: SceneParameters,
    kinect: KinectParameters,
) -> Session:
    """Perform a choreography before both Kinects."""
    place, heading = subject_place(scene)
    motion = compose(
        choreography, duration, seed, height=scene.body_height, place=place, heading=heading
    )
    poses = sensor_poses(scene)
    body_rng, *sensor_rngs = np.random.default_rng([seed, KINECT_STREAM]).spawn(1 + len(poses))
    body_bias = draw_body_bias(body_rng)
    kinects = {
        name: observe(
            motion,
            pose,
            kinect,
            body_height=scene.body_height,
            body_bias=body_bias,
            rng=rng,
        )
        for (name, pose), rng in zip(poses.items(), sensor_rngs, strict=True)
    }
    return Session(motion=motion, sensor_poses=poses, kinects=kinects)
