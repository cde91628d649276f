"""The suite on captured motion by ``./pose fuse``: sessions as bags, its output evaluated."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from scipy.spatial.transform import Rotation

from pose_bench.captured import (
    BASELINE,
    METHODS,
    CapturedMethod,
    CapturedScore,
    judge,
    label_of,
    run_method,
    true_extrinsics,
    truth_of,
    with_imus,
)
from pose_bench.suite import KNOWN
from pose_core.api import FloatArray, FusionParameters, ImuSample, SkeletonSample
from pose_core.errors import PoseError
from pose_core.joints import JOINTS
from pose_core.stamps import NS_PER_S
from pose_evaluation.offline import MethodRun
from pose_evaluation.scores import score_method
from pose_fusion.tools.fuse import fuse
from pose_io.bag_samples import read_body_series, read_estimates
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_sim.captured.session import (
    SENSORS,
    CapturedSession,
    CapturedSpec,
    make_captured_session,
    stamp_of,
)


def through_bags(spec: CapturedSpec, methods: Sequence[CapturedMethod]) -> list[CapturedScore]:
    """Evaluate ``./pose fuse`` on a session; the baseline is run in memory."""
    session = make_captured_session(spec)
    truth = truth_of(session)
    yardstick = next(method for method in METHODS if method.name == BASELINE)
    run, _ = run_method(session, yardstick, true_extrinsics(session))
    baseline = score_method(BASELINE, run.series, truth.judged_truth)
    found = []
    with tempfile.TemporaryDirectory(prefix="pose_bench_") as folder:
        in_bags = {imus: Path(folder) / f"session_{imus}" for imus in (False, True)}
        for imus, in_bag in in_bags.items():
            write_session(in_bag, session, imus=imus)
        for index, method in enumerate(methods):
            label, out_bag = label_of(spec, method), Path(folder) / f"fused_{index}"
            try:
                fused, pipeline = _fused(in_bags[method.use_imus], out_bag, method)
            except PoseError as error:
                found.append(replace(label, error=str(error)))
                continue
            scores = score_method(method.name, fused.series, truth.judged_truth)
            judged = judge(label, scores, baseline, fused, truth)
            found.append(with_imus(judged, pipeline) if method.use_imus else judged)
    return found


def _fused(in_bag: Path, out_bag: Path, method: CapturedMethod) -> tuple[MethodRun, Any]:
    parameters = FusionParameters(
        estimator=method.estimator, use_imus=method.use_imus, sensors=SENSORS
    )
    with open_bag(in_bag) as bag:
        pipeline = fuse(bag, out_bag, parameters, console=Console(quiet=True))
    with open_bag(out_bag) as bag:
        return MethodRun(
            series=read_body_series(bag), estimates=read_estimates(bag)
        ), pipeline.subject


def write_session(path: Path, session: CapturedSession, *, imus: bool) -> None:
    """Write a session's samples as a bag, with the extrinsics if they are known."""
    with BagWriter(path) as bag:
        make = _Messages(bag.typestore.types)
        if session.spec.condition == KNOWN:
            bag.add_topic("/tf_static", "tf2_msgs/msg/TFMessage", latched=True)
            stamp_ns = stamp_of(0.0)
            bag.write("/tf_static", make.transforms(session, stamp_ns), stamp_ns)
        for arrival_ns, sample in session.arrivals(imus=imus):
            if isinstance(sample, ImuSample):
                topic, message = f"/imu_{sample.segment}/data", make.imu(sample)
            else:
                topic, message = f"/kinect_{sample.sensor}/skeletons", make.skeletons(sample)
            bag.write(topic, message, arrival_ns)


class _Messages:
    """Creates messages of a typestore from samples."""

    def __init__(self, types: Any) -> None:
        self._types = types

    def _make(self, kind: str, /, **fields: Any) -> Any:
        package, _, name = kind.partition("/")
        return self._types[f"{package}/msg/{name}"](**fields)

    def _header(self, stamp_ns: int, frame_id: str) -> Any:
        sec, nanosec = divmod(stamp_ns, NS_PER_S)
        stamp = self._make("builtin_interfaces/Time", sec=sec, nanosec=nanosec)
        return self._make("std_msgs/Header", stamp=stamp, frame_id=frame_id)

    def _xyz(self, kind: str, values: FloatArray) -> Any:
        x, y, z = map(float, values)
        return self._make(f"geometry_msgs/{kind}", x=x, y=y, z=z)

    def _quaternion(self, values: FloatArray) -> Any:
        x, y, z, w = map(float, values)
        return self._make("geometry_msgs/Quaternion", x=x, y=y, z=z, w=w)

    def skeletons(self, sample: SkeletonSample) -> Any:
        header = self._header(sample.stamp_ns, f"kinect_{sample.sensor}_optical_frame")
        skeleton = self._make(
            "pose_msgs/Skeleton",
            header=header,
            id=sample.person,
            name=list(JOINTS),
            position=[self._xyz("Point", place) for place in sample.positions],
            tracking_state=np.asarray(sample.tracking_state, np.uint8),
        )
        return self._make("pose_msgs/SkeletonArray", header=header, skeletons=[skeleton])

    def imu(self, sample: ImuSample) -> Any:
        variances = np.diag(np.square(sample.orientation_stddev)).ravel()
        return self._make(
            "sensor_msgs/Imu",
            header=self._header(sample.stamp_ns, f"imu_{sample.segment}"),
            orientation=self._quaternion(sample.orientation),
            orientation_covariance=variances,
            angular_velocity=self._xyz("Vector3", sample.angular_velocity),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self._xyz("Vector3", np.zeros(3)),
            linear_acceleration_covariance=np.array([-1.0, *np.zeros(8)]),
        )

    def transforms(self, session: CapturedSession, stamp_ns: int) -> Any:
        transforms = [
            self._make(
                "geometry_msgs/TransformStamped",
                header=self._header(stamp_ns, "map"),
                child_frame_id=f"kinect_{name}_optical_frame",
                transform=self._make(
                    "geometry_msgs/Transform",
                    translation=self._xyz("Vector3", T[:3, 3]),
                    rotation=self._quaternion(Rotation.from_matrix(T[:3, :3]).as_quat()),
                ),
            )
            for name, T in session.T_map_sensor.items()
        ]
        return self._make("tf2_msgs/TFMessage", transforms=transforms)
