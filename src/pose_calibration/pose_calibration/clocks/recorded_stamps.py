"""Offsets of clocks that no motion tells, by the stamps of samples that were recorded together."""

from collections.abc import Iterable, Sequence

import numpy as np

from pose_core.api import (
    IMUS,
    ONE_IMU,
    Clock,
    Clocks,
    ImuBlock,
    SensorFrame,
    block_on_reference_clock,
    joined,
)
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S

MAX_APART_S = 0.9  # [s] of stamps recorded together; from a second on, time would run backwards
RECORDED_STDDEV_S = 0.1  # [s] of an offset found so
LEAST_BLOCKS = 1000  # [-] of IMUs' samples that are compared, of a long recording


def with_recorded_stamps(
    frames: Iterable[SensorFrame | ImuBlock], reference: str, clocks: Clocks
) -> Clocks:
    """The clocks, and those of IMUs whose stamps are far from those recorded with them.

    Args:
        frames: A recording's frames and IMUs' samples, in the order in which they were recorded.
        reference: Name of the reference sensor.
        clocks: Clocks that are known already.

    Raises:
        InputError: If a sensor's stamps are.
    """
    # Once for each stamp of the reference: while it sees nobody, its last one grows old.
    apart_ns: dict[str, dict[int, int]] = {}
    blocks: list[tuple[ImuBlock, int]] = []  # with the reference's stamp before them [ns]
    reference_ns: int | None = None
    for each in frames:
        if isinstance(each, ImuBlock):
            if reference_ns is not None and len(each):
                blocks.append((each, reference_ns))
        elif each and each[0].sensor == reference:
            reference_ns = each[0].stamp_ns
        elif each and reference_ns is not None:
            source = each[0].sensor
            newest_ns = clocks.get(source, Clock()).to_reference(each[0].stamp_ns)
            apart_ns.setdefault(source, {}).setdefault(reference_ns, newest_ns - reference_ns)
    for source, differences in apart_ns.items():
        apart_s = float(np.median([*differences.values()])) / NS_PER_S
        if abs(apart_s) > MAX_APART_S:
            raise InputError(
                f"the stamps of '{source}' are {apart_s:+.1f} s from those of "
                f"'{reference}' that were recorded at the same time, and the motion "
                "does not tell their clocks' offset: give it in the section 'clocks' of an "
                "extrinsics file (docs/calibration.md), or leave this source out"
            )
    return {**clocks, **_recorded_imu_clocks(blocks[:: len(blocks) // LEAST_BLOCKS + 1], clocks)}


def _recorded_imu_clocks(
    blocks: Sequence[tuple[ImuBlock, int]], clocks: Clocks
) -> dict[str, Clock]:
    """Clocks of IMUs whose stamps are far from the reference's that were recorded before them."""
    every = block_on_reference_clock(joined([block for block, _ in blocks]), clocks)
    reference_ns = np.repeat([ns for _, ns in blocks], [len(block) for block, _ in blocks])
    apart_ns = {}
    for imu, segment in enumerate(every.segments):
        own_ns, before_ns = every.stamps_ns[every.imu == imu], reference_ns[every.imu == imu]
        if len(own_ns):
            before_ns, first = np.unique(before_ns, return_index=True)  # the reference may pause
            apart_ns[segment] = float(np.median(own_ns[first] - before_ns))
    in_time_ns = [ns for ns in apart_ns.values() if abs(ns) <= MAX_APART_S * NS_PER_S]
    common_ns = float(np.median(in_time_ns or list(apart_ns.values()) or [0.0]))
    apart_ns = {segment: ns - common_ns for segment, ns in apart_ns.items()}
    found = {
        ONE_IMU + segment: ns
        for segment, ns in apart_ns.items()
        if abs(ns) > MAX_APART_S * NS_PER_S
    }
    if not in_time_ns and apart_ns:
        found[IMUS] = common_ns
    return {
        name: Clock(
            offset_ns=clocks.get(name, Clock()).offset_ns + round(ns), stddev_s=RECORDED_STDDEV_S
        )
        for name, ns in found.items()
    }
