"""The 15 joint centres from markers of optical motion capture (docs/references.md).

A label that names a joint centre is used as such. Otherwise the centre follows from the skin
markers of the Plug-in Gait set: hips by Harrington et al. (2007), knees and ankles by the chord
construction of Davis et al. (1991), shoulders by Rab et al. (2002).
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from pose_core.api import SkeletonSeries
from pose_core.arrays import FloatArray, unit_vectors
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS, SIDE_SIGNS, TrackingState

KNEE_OFFSET_M = 0.0595  # [m] half of a knee 105 mm wide, and a marker of 14 mm
ANKLE_OFFSET_M = 0.043  # [m] half of an ankle 72 mm wide, and a marker of 14 mm
METRES = {"mm": 0.001, "cm": 0.01, "m": 1.0, "meters": 1.0, "millimeters": 0.001}
TRUNK_M = (0.15, 1.5)  # [m] from the hips to the neck, of an infant and a giant

MEDIAL = {"knee": ("{s}knm", "{s}mkne", "{s}knem"), "ankle": ("{s}mma", "{s}mank", "{s}ankm")}
CENTRE_LABELS: dict[str, tuple[str, ...]] = {
    "shoulder": ("{side}shoulder", "{s}shoulder", "{s}sjc", "{s}clo"),
    "elbow": ("{side}elbow", "{s}elbow", "{s}ejc", "{s}huo"),
    "hand": ("{side}hand", "{side}wrist", "{s}wrist", "{s}wjc", "{s}rao"),
    "hip": ("{side}hip", "{s}hip", "{s}hjc", "{s}fep"),
    "knee": ("{side}knee", "{s}knee", "{s}kjc", "{s}feo"),
    "foot": ("{side}foot", "{side}ankle", "{s}ankle", "{s}ajc", "{s}tio"),
}
"""Labels that name a joint centre, ``{side}`` left or right, ``{s}`` l or r; the last of each is
Plug-in Gait's segment origin."""


@dataclass(frozen=True, kw_only=True)
class MarkerSeries:
    """Labelled points over time, in any right-handed frame."""

    stamps_ns: np.ndarray  # (n,) [ns] since the file's time zero
    positions: Mapping[str, FloatArray]  # (n, 3) [m] by plain label; NaN where not seen


def metres_of(unit: str, source: object) -> float:
    """A file's unit of length [m].

    Raises:
        InputError: If it is unknown.
    """
    if unit not in METRES:
        raise InputError(f"{source}: the unit '{unit}' is unknown: expected {', '.join(METRES)}")
    return METRES[unit]


def plain(label: str) -> str:
    """Normalise a label: without the subject's prefix, lower-case letters and digits only."""
    return re.sub(r"[^a-z0-9]", "", label.rpartition(":")[2].lower())


def skeleton_of_markers(markers: MarkerSeries, source: str) -> SkeletonSeries:
    """Joint centres of labelled points.

    Args:
        markers: Joint centres, Plug-in Gait markers, or both.
        source: The file's name, for errors.

    Raises:
        InputError: If they do not determine the trunk, in whose axes all angles are measured, or
            its length shows that the unit is wrong.
    """
    builder = _JointCentres(markers)
    positions = np.full((len(markers.stamps_ns), len(JOINTS), 3), np.nan)
    for joint, centre in builder.build().items():
        positions[:, JOINT_INDEX[joint]] = centre
    missing = [
        joint
        for joint in ("left_hip", "right_hip", "neck")
        if not np.isfinite(positions[:, JOINT_INDEX[joint]]).any()
    ]
    if missing:
        found = ", ".join(sorted(markers.positions)[:40]) or "no labels"
        raise InputError(
            f"{source}: {' and '.join(missing)} cannot be found: expected joint centres (left_hip "
            "or LHJC, …, neck) or Plug-in Gait markers (LASI RASI LPSI RPSI or SACR; C7 CLAV), "
            f"found {found}"
        )
    _check_unit(positions, source)
    state = np.where(
        np.isfinite(positions).all(axis=2), TrackingState.TRACKED, TrackingState.NOT_TRACKED
    )
    return SkeletonSeries(
        stamps_ns=markers.stamps_ns, positions=positions, tracking_state=state.astype(np.uint8)
    )


def _check_unit(positions: FloatArray, source: str) -> None:
    """Raise an InputError if positions (n, 15, 3) [m] are those of no person's size."""
    left, right, neck = (positions[:, JOINT_INDEX[n]] for n in ("left_hip", "right_hip", "neck"))
    length_m = _median_length(neck - 0.5 * (left + right))
    if not TRUNK_M[0] <= length_m <= TRUNK_M[1] and np.isfinite(length_m):
        raise InputError(
            f"{source}: hips and neck are {length_m:.3g} m apart, expected {TRUNK_M[0]:g} to "
            f"{TRUNK_M[1]:g} m: its numbers are not in the unit that it states: correct the unit "
            "to mm, cm or m"
        )


class _JointCentres:
    """Computes joint centres, from the trunk outwards."""

    def __init__(self, markers: MarkerSeries) -> None:
        self._markers = markers
        self._nothing = np.full((len(markers.stamps_ns), 3), np.nan)

    def build(self) -> dict[str, FloatArray]:
        centres = self._hips()
        neck = self._mean(("c7", "clav"), all_of=True)
        shoulders = 0.5 * (self._shoulder_top("left") + self._shoulder_top("right"))
        neck = np.where(np.isfinite(neck), neck, shoulders)
        centres["neck"] = self._named(("neck",), neck)
        middle = 0.5 * (centres["left_hip"] + centres["right_hip"])
        chest = self._mean(("t10", "strn"), all_of=True)
        between = 0.5 * (middle + centres["neck"])
        centres["torso"] = self._named(("torso",), np.where(np.isfinite(chest), chest, between))
        centres["head"] = self._named(("head",), self._mean(("lfhd", "rfhd", "lbhd", "rbhd")))
        up = unit_vectors(centres["neck"] - middle)
        outward = unit_vectors(centres["left_hip"] - centres["right_hip"])
        for side, sign in SIDE_SIGNS.items():
            self._leg(centres, side, sign * outward)
            self._arm(centres, side, up)
        return centres

    def _hips(self) -> dict[str, FloatArray]:
        left, right = (self._mean((f"{s}asi", f"{s}asis"), first=True) for s in "lr")
        back = self._mean(("lpsi", "rpsi"), all_of=True)
        sacrum = self._mean(("sacr", "sac", "vsac"), first=True)
        back = np.where(np.isfinite(back), back, sacrum)
        front = 0.5 * (left + right)
        y = unit_vectors(left - right)
        forward = front - back
        x = unit_vectors(forward - np.sum(forward * y, axis=1, keepdims=True) * y)
        z = np.cross(x, y)
        width = _median_length(left - right)
        depth = _median_length(forward)
        # Harrington et al. (2007), J Biomech 40:595, table 3, from the middle of the ASIS [m].
        ahead = -0.24 * depth - 0.0099
        up = -0.30 * width - 0.0109
        aside = 0.33 * width + 0.0073
        return {
            f"{side}_hip": self._centre(side, "hip", front + ahead * x + up * z + sign * aside * y)
            for side, sign in SIDE_SIGNS.items()
        }

    def _leg(self, centres: dict[str, FloatArray], side: str, outward: FloatArray) -> None:
        s = side[0]
        hip = centres[f"{side}_hip"]
        knee = self._hinge(hip, f"{s}kne", f"{s}thi", "knee", s, outward)
        knee = self._centre(side, "knee", knee)
        ankle = self._hinge(knee, f"{s}ank", f"{s}tib", "ankle", s, outward)
        centres[f"{side}_knee"] = knee
        centres[f"{side}_foot"] = self._centre(side, "foot", ankle)

    def _hinge(
        self, above: FloatArray, lateral: str, wand: str, joint: str, s: str, outward: FloatArray
    ) -> FloatArray:
        """Centre of a hinge: midpoint of its two markers, else by the lateral one's chord."""
        marker = self._mean((lateral,))
        medial = self._mean([name.format(s=s) for name in MEDIAL[joint]], first=True)
        beside = self._mean((wand,))
        beside = np.where(np.isfinite(beside), beside, marker + 0.1 * outward)
        offset = KNEE_OFFSET_M if joint == "knee" else ANKLE_OFFSET_M
        centre = _chord(above, marker, beside, offset)
        return np.where(np.isfinite(medial), 0.5 * (marker + medial), centre)

    def _arm(self, centres: dict[str, FloatArray], side: str, up: FloatArray) -> None:
        s = side[0]
        top = self._shoulder_top(side)
        span = _median_length(self._shoulder_top("left") - self._shoulder_top("right"))
        # Rab et al. (2002), Gait & Posture 15:113: 17 % of the acromia's distance below them.
        centres[f"{side}_shoulder"] = self._centre(side, "shoulder", top - 0.17 * span * up)
        lateral = self._mean((f"{s}elb",))
        medial = self._mean((f"{s}elbm", f"{s}melb", f"{s}mel"), first=True)
        elbow = np.where(np.isfinite(medial), 0.5 * (lateral + medial), lateral)
        centres[f"{side}_elbow"] = self._centre(side, "elbow", elbow)
        wrist = self._mean((f"{s}wra", f"{s}wrb"))
        centres[f"{side}_hand"] = self._centre(side, "hand", wrist)

    def _shoulder_top(self, side: str) -> FloatArray:
        return self._mean((f"{side[0]}sho",))

    def _centre(self, side: str, joint: str, built: FloatArray) -> FloatArray:
        labels = [label.format(side=side, s=side[0]) for label in CENTRE_LABELS[joint]]
        return self._named(labels, built)

    def _named(self, labels: Iterable[str], built: FloatArray) -> FloatArray:
        """The point labelled as this joint, else the computed centre."""
        for label in labels:
            if label in self._markers.positions:
                return self._markers.positions[label]
        return built

    def _mean(
        self, labels: Iterable[str], *, all_of: bool = False, first: bool = False
    ) -> FloatArray:
        """Mean of the available markers; NaN where one is hidden, or if there are none."""
        labels = list(labels)
        found = [self._markers.positions[m] for m in labels if m in self._markers.positions]
        if not found or (all_of and len(found) < len(labels)):
            return self._nothing
        return found[0] if first else np.mean(found, axis=0)


def _chord(
    above: FloatArray, marker: FloatArray, beside: FloatArray, offset_m: float
) -> FloatArray:
    """Joint centre at a distance from its marker, in the plane of three points, (n, 3) [m] each.

    Davis et al. (1991), Hum Mov Sci 10:575: the directions from the centre to the joint above and
    to the marker are orthogonal; the centre is on the opposite side from the point ``beside``.
    """
    limb = above - marker
    length = np.linalg.norm(limb, axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        along = limb / length
        away = beside - marker
        away = -unit_vectors(away - np.sum(away * along, axis=1, keepdims=True) * along)
        share = offset_m / length
        return marker + offset_m * (share * along + np.sqrt(1.0 - share**2) * away)


def _median_length(vectors: FloatArray) -> float:
    lengths = np.linalg.norm(vectors, axis=1)
    known = lengths[np.isfinite(lengths)]
    return float(np.median(known)) if len(known) else np.nan
