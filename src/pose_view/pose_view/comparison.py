"""Bodies that were not recorded, computed: the fused one, and each kind of sensor alone."""

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from pose_core.api import EstimateBlock, Extrinsics, FusionParameters, PeoplePipeline
from pose_core.errors import PoseError
from pose_io.bag_samples import BagFrames
from pose_io.bags import BagReader
from pose_io.topics import imu_topics
from pose_view.messages import estimate_snapshot
from pose_view.recorded import Recorded
from pose_view.snapshot import BodySnapshot

FUSED = "fused"
SETTINGS: Mapping[str, Mapping[str, Any]] = {
    "kinect": {"use_imus": False},
    "imu": {"estimator": "imu"},
    FUSED: {},
}
"""What the fusion is told, by kind of body: the ending of its id, if it uses one kind of sensor."""


def missing_bodies(
    recorded: Recorded, bodies: tuple[str, ...], bag: BagReader, *, alone: bool = True
) -> dict[str, str]:
    """The bodies that can be computed from a bag and were not recorded, each with its kind.

    Args:
        recorded: What the bag holds.
        bodies: Ids that are wanted.
        bag: The open bag.
        alone: Whether those of one kind of sensor alone are wanted too.
    """
    if not recorded.has_raw:
        return {}
    has_imus, is_raw = bool(imu_topics(bag)), not recorded.bodies
    kinds = {FUSED} if is_raw else set()
    if alone:
        # Without IMUs the cameras alone are all that is fused.
        kinds |= {"kinect", "imu"} if has_imus else set() if is_raw else {"kinect"}
    found = {}
    for body in bodies:
        ending = body.rpartition("_")[2]
        kind = ending if ending in SETTINGS else FUSED
        if body not in recorded.bodies and kind in kinds:
            found[body] = kind
    return found


def compute_bodies(
    bag: BagReader,
    kind: str,
    parameters: FusionParameters,
    extrinsics: Extrinsics,
    progress: Callable[[float], None],
) -> dict[str, list[BodySnapshot]]:
    """What the fusion says of the people in a bag, by body.

    Args:
        bag: An open bag.
        kind: Which sensors it uses, of :data:`SETTINGS`.
        parameters: Whom it follows, and of which sensors.
        extrinsics: The sensors' poses.
        progress: Called with the share that is done.

    Raises:
        PoseError: If the fusion cannot do it.
    """
    bodies: dict[str, list[BodySnapshot]] = defaultdict(list)

    def show(body: str, block: EstimateBlock) -> None:
        bodies[body] += [estimate_snapshot(estimate) for estimate in block]

    pipeline = PeoplePipeline(replace(parameters, **SETTINGS[kind]), show, extrinsics)
    for each in BagFrames(bag, progress, imus=kind != "kinect"):
        pipeline.add(each)
    pipeline.flush()
    if not bodies:
        raise PoseError(pipeline.status)
    return bodies
