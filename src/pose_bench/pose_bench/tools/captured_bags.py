"""The suite on captured motion by ``./pose fuse``: sessions as bags, its output evaluated."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from pose_bench.captured import CapturedMethod, CapturedScore, run_baseline, score_runs
from pose_bench.captured_suite import KNOWN
from pose_core.api import ImuSample
from pose_evaluation.offline import MethodRun
from pose_fusion.parameters import FusionNodeParameters
from pose_fusion.tools.fuse import fuse
from pose_io.bag_samples import read_body_series, read_estimates
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.message_maker import MessageMaker
from pose_io.names import TF_STATIC, imu_topic, sensor_frame, skeletons_topic
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
    with tempfile.TemporaryDirectory(prefix="pose_bench_") as folder:
        in_bags = {imus: Path(folder) / f"session_{imus}" for imus in (False, True)}
        for imus, in_bag in in_bags.items():
            write_session(in_bag, session, imus=imus)

        def run(method: CapturedMethod) -> tuple[MethodRun, Any]:
            out_bag = Path(folder) / f"fused_{methods.index(method)}"
            return _fused(in_bags[method.use_imus], out_bag, method)

        return score_runs(session, methods, run_baseline(session)[0], run)


def _fused(in_bag: Path, out_bag: Path, method: CapturedMethod) -> tuple[MethodRun, Any]:
    parameters = FusionNodeParameters(
        estimator=method.estimator, use_imus=method.use_imus, sensors=SENSORS
    )
    with open_bag(in_bag) as bag:
        pipeline = fuse(bag, out_bag, parameters, console=Console(quiet=True))
    with open_bag(out_bag) as bag:
        run = MethodRun(series=read_body_series(bag), estimates=read_estimates(bag))
    return run, pipeline.subject


def write_session(path: Path, session: CapturedSession, *, imus: bool) -> None:
    """Write a session's samples as a bag, with the extrinsics if they are known."""
    with BagWriter(path) as bag:
        make = MessageMaker(bag.typestore)
        if session.spec.condition == KNOWN:
            bag.add_topic(TF_STATIC, "tf2_msgs/msg/TFMessage", latched=True)
            stamp_ns = stamp_of(0.0)
            bag.write(TF_STATIC, make.sensor_transforms(session.T_map_sensor, stamp_ns), stamp_ns)
        for arrival_ns, sample in session.arrivals(imus=imus):
            if isinstance(sample, ImuSample):
                topic, frame_id = f"/{imu_topic(sample.segment)}", f"imu_{sample.segment}"
                message = make.imu(
                    make.header(sample.stamp_ns, frame_id),
                    sample.orientation,
                    sample.orientation_stddev,
                    sample.angular_velocity,
                )
            else:
                topic = f"/{skeletons_topic(sample.sensor)}"
                header = make.header(sample.stamp_ns, sensor_frame(sample.sensor))
                message = make.frame(header, [sample])
            bag.write(topic, message, arrival_ns)
