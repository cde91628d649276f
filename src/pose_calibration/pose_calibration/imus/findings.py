"""What is wrong with the sensors, in words: silent, still, exchanged, upside down."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pose_calibration.imus.explaining import Explanations
from pose_calibration.imus.guidance import how_to_move, wanted_stddev
from pose_calibration.imus.observations import ImuObservations
from pose_core.api import SensorToSegment

LEAST_HEARD = 0.8  # [-] of the time
MOVED = math.radians(25.0)  # [rad] that a segment must have turned for its sensor to show it
UNMOVED = math.radians(6.0)  # [rad] that a sensor which lies on the table turns at most
MOST = 95.0  # [%] percentile that stands for the largest angle
ALIKE, OPPOSITE = 0.5, -0.5  # [-] cosines between sensors' axes along the body
LEAST_TO_COMPARE = 4  # [-] sensors, to compare one with the others


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Something about the sensors of some segments."""

    segments: tuple[str, ...]
    text: str
    is_fault: bool  # else it is only worth knowing


def faults_of(observations: ImuObservations, explanations: Explanations) -> list[Finding]:
    """What makes a sensor useless as it is."""
    found = [*_silent(observations), *_unmoved(observations)]
    named = {segment for finding in found for segment in finding.segments}
    for first, second in explanations.swapped:
        if not named & {first, second}:
            text = (
                f"the sensors of {first} and {second} are exchanged: exchange them in the nodes "
                "file, or on the body"
            )
            found.append(Finding(segments=(first, second), text=text, is_fault=True))
    named = {segment for finding in found for segment in finding.segments}
    for segment in explanations.upside_down_worlds:
        if segment not in named:
            text = (
                f"the sensor of {segment} turns the wrong way round: its world is upside down (z "
                "points down); have it send z up (ENU), or raw data"
            )
            found.append(Finding(segments=(segment,), text=text, is_fault=True))
    return found


def remarks_on(alignments: Mapping[str, SensorToSegment]) -> list[Finding]:
    """What is unusual, and taken into account: sensors the other way up than the others."""
    if len(alignments) < LEAST_TO_COMPARE:
        return []
    names = list(alignments)
    along = np.stack([alignments[name].R_sensor_segment[:, 2] for name in names])
    cosine = along @ along.T
    usual = [i for i in range(len(names)) if np.median(cosine[i]) > ALIKE]
    if len(usual) <= len(names) // 2:
        return []
    return [
        Finding(
            segments=(name,),
            text=f"the sensor of {name} sits upside down, compared with the others: that is "
            "allowed for, unless it was not meant",
            is_fault=False,
        )
        for i, name in enumerate(names)
        if np.median(cosine[i, usual]) < OPPOSITE
    ]


def uncertain(alignments: Mapping[str, SensorToSegment], enough: float) -> list[Finding]:
    """Alignments less certain than ``enough`` [rad] that motion could have made more certain."""
    return [
        Finding(
            segments=(segment,),
            text=f"{segment} is known to {np.degrees(wanted_stddev(segment, alignment)):.0f} deg "
            f"only: calibrate again and {how_to_move(segment)}",
            is_fault=False,
        )
        for segment, alignment in alignments.items()
        if wanted_stddev(segment, alignment) > enough
    ]


def _silent(o: ImuObservations) -> list[Finding]:
    heard = np.isfinite(o.rate).mean(axis=0)
    standing = np.isfinite(o.rate[o.is_neutral]).mean(axis=0)
    found = []
    for segment, share, then in zip(o.segments, heard, standing, strict=True):
        if then == 0.0:
            text = f"the sensor of {segment} was silent while you stood still"
        elif share < LEAST_HEARD:
            text = f"the sensor of {segment} was heard only {share:.0%} of the time"
        else:
            continue
        found.append(
            Finding(segments=(segment,), text=f"{text}: look at its cable or radio", is_fault=True)
        )
    return found


def _unmoved(o: ImuObservations) -> list[Finding]:
    found = []
    for i, segment in enumerate(o.segments):
        axis = o.long_axis[:, i]
        axis = axis[np.isfinite(axis[:, 0])]
        R = o.R_world_sensor[:, i]
        R = R[np.isfinite(R[:, 0, 0])]
        if len(axis) == 0 or len(R) == 0:
            continue
        inclination = np.percentile(np.arccos(np.clip(axis[:, 2], -1.0, 1.0)), MOST)
        trace = np.einsum("nij,ij->n", R, R[0])
        turned = np.percentile(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)), MOST)
        if inclination > MOVED and turned < UNMOVED:
            text = (
                f"the sensor of {segment} does not move ({np.degrees(turned):.0f} deg, the segment "
                f"{np.degrees(inclination):.0f} deg): strap it on, or look whether it has hung up"
            )
            found.append(Finding(segments=(segment,), text=text, is_fault=True))
    return found
