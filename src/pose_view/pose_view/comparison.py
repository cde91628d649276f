"""The bodies beside the fused one: the cameras alone and the IMUs alone, computed where missing."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from pose_core.api import FusionParameters, FusionPipeline, extrinsics_from_map
from pose_core.errors import PoseError
from pose_core.parameters import from_mapping
from pose_io.bag_samples import BagSamples
from pose_io.bags import BagReader
from pose_io.topics import imu_topics
from pose_view.messages import estimate_snapshot
from pose_view.recorded import Recorded
from pose_view.snapshot import BodySnapshot

ALONE: Mapping[str, Mapping[str, object]] = {
    "kinect": {"use_imus": False},
    "imu": {"estimator": "imu"},
}
"""What the fusion is told so that it uses one kind of sensor alone, by the body's ending."""


def missing_bodies(recorded: Recorded, bodies: tuple[str, ...], bag: BagReader) -> dict[str, str]:
    """The bodies that can be computed from a bag and were not recorded, each with its kind."""
    kinds = {body: body.rpartition("_")[2] for body in bodies if body not in recorded.bodies}
    if not recorded.sensors:
        return {}
    return {
        body: kind
        for body, kind in kinds.items()
        if kind in ALONE and (kind != "imu" or imu_topics(bag))
    }


def compute_body(
    bag: BagReader, recorded: Recorded, kind: str, progress: Callable[[float], None]
) -> list[BodySnapshot]:
    """What one kind of sensor alone says of the person in a bag.

    Raises:
        PoseError: If the fusion cannot do it.
    """
    parameters = from_mapping(FusionParameters, dict(ALONE[kind]))
    placed = {name: recorded.sensors[name] for name in sorted(recorded.sensors)}
    parameters = replace(parameters, sensors=tuple(placed))
    extrinsics = extrinsics_from_map(placed)
    samples = BagSamples(bag, progress=progress, extrinsics=extrinsics, imus=kind == "imu")
    pipeline = FusionPipeline(parameters, extrinsics)
    estimates = [estimate for sample in samples for estimate in pipeline.add(sample)]
    estimates += pipeline.flush()
    if not estimates:
        raise PoseError(pipeline.status)
    return [estimate_snapshot(estimate) for estimate in estimates]
