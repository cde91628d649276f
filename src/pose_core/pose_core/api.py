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

from pose_core.arrays import FloatArray as FloatArray
from pose_core.body.frames import BodyFrames as BodyFrames
from pose_core.body.joint_angles import (
    ABDUCTION_OF as ABDUCTION_OF,
    ANGLES as ANGLES,
    joint_angles as joint_angles,
    unwrapped as unwrapped,
    wrapped as wrapped,
)
from pose_core.body.kinematics import (
    BodyPose as BodyPose,
    ForwardKinematics as ForwardKinematics,
    skew as skew,
)
from pose_core.body.model import (
    ROOT_DOF as ROOT_DOF,
    BodyModel as BodyModel,
    Dof as Dof,
    Link as Link,
    available_models as available_models,
    load_body_model as load_body_model,
)
from pose_core.body.shape import (
    BodyShape as BodyShape,
    BodyShapeError as BodyShapeError,
    estimate_body_shape as estimate_body_shape,
    load_body_shape as load_body_shape,
    save_body_shape as save_body_shape,
)
from pose_core.body.urdf import make_urdf as make_urdf
from pose_core.counters import Counters as Counters
from pose_core.errors import (
    InputError as InputError,
    ParameterError as ParameterError,
    PoseError as PoseError,
)
from pose_core.estimates.body_estimates import (
    BodyEstimate as BodyEstimate,
    EstimateBlock as EstimateBlock,
)
from pose_core.estimators import ESTIMATORS as ESTIMATORS
from pose_core.estimators.default import DefaultEstimator as DefaultEstimator
from pose_core.estimators.estimator import (
    Estimator as Estimator,
    StepwiseEstimator as StepwiseEstimator,
)
from pose_core.estimators.parameters import PipelineParameters as PipelineParameters
from pose_core.estimators.registry import (
    body_model_of as body_model_of,
    estimator_class as estimator_class,
)
from pose_core.filter.tuning import (
    CameraNoise as CameraNoise,
    FilterTuning as FilterTuning,
    ImuNoise as ImuNoise,
    MotionPrior as MotionPrior,
    PosturePrior as PosturePrior,
    StartNoise as StartNoise,
    load_tuning as load_tuning,
)
from pose_core.fusion.alignment_history import AlignmentHistory as AlignmentHistory
from pose_core.fusion.offline import (
    first_pass as first_pass,
    fuse as fuse,
    run_first_pass as run_first_pass,
    series_of_estimates as series_of_estimates,
    with_measured_delay as with_measured_delay,
)
from pose_core.fusion.output_grid import has_output_rate as has_output_rate
from pose_core.fusion.pipeline import UNKNOWN_DELAY_S as UNKNOWN_DELAY_S, Pipeline as Pipeline
from pose_core.fusion.warm_up import warm_up as warm_up
from pose_core.imu.imu_use import ImuUse as ImuUse
from pose_core.imu.sensor_to_segment import (
    SensorsToSegments as SensorsToSegments,
    SensorToSegment as SensorToSegment,
)
from pose_core.joints import (
    JOINT_INDEX as JOINT_INDEX,
    JOINTS as JOINTS,
    SEGMENTS as SEGMENTS,
    SIDES as SIDES,
    TrackingState as TrackingState,
)
from pose_core.kernels.published_state import Source as Source
from pose_core.kernels.rotations import (
    matrix_of_quaternion as matrix_of_quaternion,
    quaternion as quaternion,
)
from pose_core.people.person_choice import ChosenPerson as ChosenPerson
from pose_core.people.pipeline import PeoplePipeline as PeoplePipeline
from pose_core.people.tracker import PeopleTracker as PeopleTracker
from pose_core.session.extrinsics import (
    LITTLE_MOTION as LITTLE_MOTION,
    BoardResiduals as BoardResiduals,
    Extrinsics as Extrinsics,
    FloorEstimate as FloorEstimate,
    PairResiduals as PairResiduals,
    SessionBody as SessionBody,
    extrinsics_from_map as extrinsics_from_map,
)
from pose_core.streams.angle_series import (
    AngleSeries as AngleSeries,
    anatomical as anatomical,
    angle_columns as angle_columns,
    angle_series as angle_series,
    without_sideways_flexion as without_sideways_flexion,
)
from pose_core.streams.clock_steps import ClockSteps as ClockSteps
from pose_core.streams.clocks import (
    IMUS as IMUS,
    ONE_IMU as ONE_IMU,
    USUAL_DELAY_S as USUAL_DELAY_S,
    Clock as Clock,
    Clocks as Clocks,
    block_on_reference_clock as block_on_reference_clock,
    earlier_than_reference_s as earlier_than_reference_s,
    is_imus as is_imus,
    moved_most_ns as moved_most_ns,
    on_reference_clock as on_reference_clock,
    reference_delay_s as reference_delay_s,
    series_on_reference_clock as series_on_reference_clock,
)
from pose_core.streams.estimate_series import (
    EstimateSeries as EstimateSeries,
    estimate_series as estimate_series,
)
from pose_core.streams.recording_order import RecordingOrder as RecordingOrder, in_order as in_order
from pose_core.streams.repeated_frames import RepeatedFrames as RepeatedFrames
from pose_core.streams.samples import (
    ImuBlock as ImuBlock,
    ImuSample as ImuSample,
    SensorFrame as SensorFrame,
    SkeletonSample as SkeletonSample,
    block_of as block_of,
    interleaved as interleaved,
    joined as joined,
)
from pose_core.streams.series import (
    MAX_GAP_S as MAX_GAP_S,
    IntArray as IntArray,
    SkeletonSeries as SkeletonSeries,
    longest_gap_s as longest_gap_s,
    series_from_samples as series_from_samples,
)
from pose_core.streams.stamp_check import StampCheck as StampCheck
from pose_core.streams.time_alignment import (
    AlignedFrame as AlignedFrame,
    TimeAligner as TimeAligner,
)
from pose_core.streams.tracked_joints import TrackedJoints as TrackedJoints
from pose_core.transforms import (
    best_rigid_transform as best_rigid_transform,
    inverse as inverse,
    rigid_transform as rigid_transform,
    transformed as transformed,
)

Skeleton = SkeletonSample
PoseEstimate = BodyEstimate
"""Short names for notebooks; in nodes they would shadow the messages of the same names."""
