"""Notices when a filter follows something that is not there: a limb, or the whole person."""

from collections.abc import Sequence
from math import isfinite
from statistics import median

from pose_common.joints import JOINT_INDEX
from pose_fusion.body.model import BodyModel
from pose_fusion.streams.samples import FloatArray

FAR = 25.0  # [-] squared Mahalanobis distance: 3 degrees of freedom, far beyond any outlier
PATIENCE_NS = 250_000_000  # [ns] for which a joint may be that far off
LIMBS = {
    "left_arm": ("left_elbow", "left_hand"),
    "right_arm": ("right_elbow", "right_hand"),
    "left_leg": ("left_knee", "left_foot"),
    "right_leg": ("right_knee", "right_foot"),
}
BODY = ("neck", "torso", "left_shoulder", "right_shoulder", "left_hip", "right_hip")


class LostLimbs:
    """Watches how far each joint's samples are from what the filter expects.

    Args:
        model: The body model.
    """

    def __init__(self, model: BodyModel) -> None:
        self._joints = {name: [JOINT_INDEX[j] for j in ends] for name, ends in LIMBS.items()}
        self._body = [JOINT_INDEX[name] for name in BODY]
        self._links = {
            name: [
                index
                for index, link in enumerate(model.links.values())
                if link.joint is not None and model.ends(link.name)[1] in ends
            ]
            for name, ends in LIMBS.items()
        }
        self._since_ns: dict[str, int] = {}

    def check(self, stamp_ns: int, distance: FloatArray, farthest: float) -> Sequence[int] | None:
        """Judge one update.

        Args:
            stamp_ns: Its instant.
            distance: Squared Mahalanobis distance of each joint, shape (15,); NaN unseen.
            farthest: The largest of them.

        Returns:
            The links of limbs that are lost; None if the whole person is.
        """
        if not self._since_ns and not farthest >= FAR:  # false of NaN
            return []
        distances = distance.tolist()
        if self._has_been_far("body", self._body, stamp_ns, distances):
            self._since_ns.clear()
            return None
        lost = [
            name
            for name, joints in self._joints.items()
            if self._has_been_far(name, joints, stamp_ns, distances)
        ]
        for name in lost:
            del self._since_ns[name]
        return [link for name in lost for link in self._links[name]]

    def _has_been_far(
        self, name: str, joints: list[int], stamp_ns: int, distances: list[float]
    ) -> bool:
        seen = [distances[joint] for joint in joints if isfinite(distances[joint])]
        if not seen:
            return False
        if median(seen) < FAR:
            self._since_ns.pop(name, None)
            return False
        since_ns = self._since_ns.setdefault(name, stamp_ns)
        if stamp_ns < since_ns:
            self._since_ns[name] = stamp_ns
        return stamp_ns - self._since_ns[name] > PATIENCE_NS
