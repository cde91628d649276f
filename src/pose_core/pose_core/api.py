"""The public API of the core, for other packages and notebooks.

::

    from pose_core.api import Pipeline, PipelineParameters, fuse

    series = fuse(samples, extrinsics)          # a whole recording at once
    series.position[:, series.names.index("left_knee_flexion")]         # [rad]
    series.position_stddev[:, series.names.index("left_knee_flexion")]  # [rad]

    pipeline = Pipeline(PipelineParameters(sensors=("left", "right")), extrinsics)
    for sample in live_samples:                 # or sample by sample
        for estimate in pipeline.add(sample):
            print(estimate.stamp_ns, estimate.dof_names, estimate.position)

``pipeline.imu_uses`` says of each IMU whether it is used, and why not; ``pipeline.counters`` counts
what was left out. The first call compiles the estimator, which takes a minute or two.

Frames, axes and units: ``docs/conventions.md``. Stamps are integer nanoseconds; no function reads a
clock. Errors that the user can correct are raised as a :class:`PoseError` with a message of one
line. The modules ``arrays``, ``joints``, ``errors``, ``stamps``, ``counters``, ``parameters``,
``finite_numbers``, ``plain_yaml``, ``atomic_file`` and ``lower_line`` are public, too; they import
neither numba nor scipy, so that small processes start fast. Everything else may change.
"""

from pose_core.arrays import FloatArray
from pose_core.body.frames import BodyFrames
from pose_core.body.joint_angles import ABDUCTION_OF, ANGLES, joint_angles, unwrapped, wrapped
from pose_core.body.kinematics import BodyPose, ForwardKinematics, skew
from pose_core.body.model import ROOT_DOF, BodyModel, Dof, Link, available_models, load_body_model
from pose_core.body.shape import (
    BodyShape,
    BodyShapeError,
    estimate_body_shape,
    load_body_shape,
    save_body_shape,
)
from pose_core.body.urdf import make_urdf
from pose_core.counters import Counters
from pose_core.errors import InputError, ParameterError, PoseError
from pose_core.estimates.body_estimates import BodyEstimate, EstimateBlock, Source
from pose_core.estimators import ESTIMATORS
from pose_core.estimators.estimator import Estimator, StepwiseEstimator
from pose_core.estimators.parameters import PipelineParameters
from pose_core.estimators.registry import body_model_of, estimator_class
from pose_core.fusion.alignment_history import AlignmentHistory
from pose_core.fusion.offline import (
    first_pass,
    fuse,
    run_first_pass,
    series_of_estimates,
    with_measured_delay,
)
from pose_core.fusion.output_grid import has_output_rate
from pose_core.fusion.pipeline import Pipeline
from pose_core.fusion.warm_up import warm_up
from pose_core.imu.imu_use import ImuUse
from pose_core.imu.sensor_to_segment import SensorsToSegments, SensorToSegment
from pose_core.joints import JOINT_INDEX, JOINTS, SEGMENTS, SIDES, TrackingState
from pose_core.people.person_choice import ChosenPerson
from pose_core.people.pipeline import PeoplePipeline
from pose_core.people.tracker import PeopleTracker
from pose_core.session.extrinsics import (
    LITTLE_MOTION,
    BoardResiduals,
    Extrinsics,
    FloorEstimate,
    PairResiduals,
    SessionBody,
    extrinsics_from_map,
)
from pose_core.streams.angle_series import (
    AngleSeries,
    anatomical,
    angle_columns,
    angle_series,
    without_sideways_flexion,
)
from pose_core.streams.clocks import (
    IMUS,
    ONE_IMU,
    Clock,
    Clocks,
    block_on_reference_clock,
    is_imus,
    moved_most_ns,
    on_reference_clock,
    series_on_reference_clock,
)
from pose_core.streams.estimate_series import EstimateSeries, estimate_series
from pose_core.streams.recording_order import RecordingOrder, in_order
from pose_core.streams.repeated_frames import RepeatedFrames
from pose_core.streams.samples import (
    ImuBlock,
    ImuSample,
    SkeletonSample,
    block_of,
    interleaved,
    joined,
)
from pose_core.streams.series import (
    MAX_GAP_S,
    IntArray,
    SkeletonSeries,
    longest_gap_s,
    series_from_samples,
)
from pose_core.streams.stamp_check import StampCheck
from pose_core.streams.time_alignment import AlignedFrame, TimeAligner
from pose_core.streams.tracked_joints import TrackedJoints
from pose_core.transforms import best_rigid_transform, inverse, rigid_transform, transformed

Skeleton = SkeletonSample
PoseEstimate = BodyEstimate
"""Short names for notebooks; in nodes they would shadow the messages of the same names."""

__all__ = [
    "AlignmentHistory",
    "ABDUCTION_OF",
    "ANGLES",
    "AlignedFrame",
    "AngleSeries",
    "BoardResiduals",
    "BodyEstimate",
    "BodyFrames",
    "BodyModel",
    "BodyPose",
    "BodyShape",
    "BodyShapeError",
    "ChosenPerson",
    "Clock",
    "Clocks",
    "Counters",
    "Dof",
    "ESTIMATORS",
    "EstimateBlock",
    "EstimateSeries",
    "Estimator",
    "Extrinsics",
    "FloatArray",
    "FloorEstimate",
    "ForwardKinematics",
    "IMUS",
    "ONE_IMU",
    "ImuBlock",
    "ImuSample",
    "ImuUse",
    "InputError",
    "IntArray",
    "JOINTS",
    "JOINT_INDEX",
    "Link",
    "LITTLE_MOTION",
    "MAX_GAP_S",
    "longest_gap_s",
    "PairResiduals",
    "ParameterError",
    "PeoplePipeline",
    "PeopleTracker",
    "Pipeline",
    "PipelineParameters",
    "PoseError",
    "PoseEstimate",
    "ROOT_DOF",
    "RecordingOrder",
    "RepeatedFrames",
    "SEGMENTS",
    "SIDES",
    "SessionBody",
    "SensorToSegment",
    "SensorsToSegments",
    "Skeleton",
    "SkeletonSample",
    "SkeletonSeries",
    "Source",
    "StampCheck",
    "StepwiseEstimator",
    "TimeAligner",
    "TrackedJoints",
    "TrackingState",
    "angle_columns",
    "anatomical",
    "angle_series",
    "available_models",
    "best_rigid_transform",
    "block_of",
    "block_on_reference_clock",
    "body_model_of",
    "estimate_body_shape",
    "estimate_series",
    "estimator_class",
    "extrinsics_from_map",
    "has_output_rate",
    "first_pass",
    "fuse",
    "in_order",
    "interleaved",
    "inverse",
    "is_imus",
    "joined",
    "joint_angles",
    "load_body_model",
    "load_body_shape",
    "make_urdf",
    "moved_most_ns",
    "on_reference_clock",
    "rigid_transform",
    "run_first_pass",
    "save_body_shape",
    "series_from_samples",
    "series_of_estimates",
    "series_on_reference_clock",
    "skew",
    "transformed",
    "unwrapped",
    "without_sideways_flexion",
    "warm_up",
    "with_measured_delay",
    "wrapped",
]
