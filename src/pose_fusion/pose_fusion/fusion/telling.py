"""From an estimator's pose to what the fusion says of a person."""

from collections.abc import Sequence

import numpy as np

from pose_fusion.body.model import BodyModel
from pose_fusion.fusion.estimates import BodyEstimate
from pose_fusion.fusion.estimators.estimator import TimedPose
from pose_fusion.kernels.frames import place_origins


def body_estimate(
    told: TimedPose, model: BodyModel, sensors: Sequence[str], newest_ns: int
) -> BodyEstimate:
    """What the fusion says of one person.

    Args:
        told: The pose and its instant.
        model: The body model.
        sensors: Names, in the order of the pose's weights.
        newest_ns: Stamp of the newest sample of any source [ns].
    """
    fused = told.pose
    T_map_link = np.empty((len(model.links), 4, 4))
    place_origins(
        np.ascontiguousarray(fused.position),
        np.ascontiguousarray(fused.rotations),
        np.ascontiguousarray(fused.joints),
        model.link_joints,
        T_map_link,
    )
    return BodyEstimate(
        stamp_ns=told.stamp_ns,
        newest_ns=newest_ns,
        dof_names=model.dof_names,
        position=fused.position,
        velocity=fused.velocity,
        position_stddev=np.sqrt(fused.variance),
        weight_kinect=fused.weight_kinect,
        weight_imu=fused.weight_imu,
        source=fused.source,
        joints=fused.joints,
        tracking_state=told.tracking_state,
        link_names=model.link_names,
        T_map_link=T_map_link,
        sensor_weight=dict(zip(sensors, fused.sensor_weight, strict=True)),
    )
