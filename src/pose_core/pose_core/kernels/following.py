"""A segment filter that follows a person, from observation to observation, many at one call.

It stops at what seldom happens, a start or a covariance that broke, which is the caller's to see
to, and goes on from there.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.camera import CameraLooks
from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.correction import Expectations, correct
from pose_core.kernels.fit import note_fit, scale_of
from pose_core.kernels.handover import Handover, glide_no_more, glide_on
from pose_core.kernels.links import LinkLooks
from pose_core.kernels.lost_limbs import EVERYTHING, NONE, LimbNumbers, find_lost, forget
from pose_core.kernels.placing import Pose
from pose_core.kernels.prediction import MotionNumbers, predict
from pose_core.kernels.reading import StateNumbers
from pose_core.kernels.sources import NEVER, hear, miss
from pose_core.kernels.telling import keep
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import FloatArray

LATEST_S = 0.2  # [s] a frame that is later says too little of now
JUMP_BACK_S = 1.0  # [s] further back than this, a recording has begun anew
EVENT_NS = 100_000_000  # [ns] for which an event's corrections come
REOPENED_RATE_STDDEV = 1.0  # [rad/s]

# How an observation begins: the filter goes on; it has been started, and nothing has gone out
# before; anew, after something has; after it had taken this observation, and strayed.
GOING_ON, STARTED, STARTED_ANEW, STRAYED_FROM = range(4)
# How it ends: the filter is to be started; its covariance broke; it follows nobody; the frame is
# too late; it was taken; so that a limb was found to be elsewhere. All have been taken: FOLLOWED.
TO_START, BROKEN, STRAYED, TOO_LATE, TAKEN, REOPENED, FOLLOWED = range(7)
# What is counted.
FRAMES_TOO_LATE, FRAMES_LATE, LIMBS_REOPENED, TURNED_BACK, SIDES_SWAPPED, COUNTS = range(6)
FILTER, EVENT = range(2)
AHEAD, TYPICAL = range(2)


class Seen(NamedTuple):
    """n observations, with m IMUs' readings in all."""

    stamps_ns: NDArray[np.int64]  # (n,) [ns]
    positions: FloatArray  # (n, sensors, joints, 3) [m] in map; NaN unseen
    tracking_state: NDArray[np.uint8]  # (n, sensors, joints)
    cameras: FloatArray  # (n, sensors, 3) [m] in map
    offsets: FloatArray  # (n, sensors, joints, 3) [m] see CameraLooks
    first_reading: NDArray[np.int64]  # (n + 1,) of each observation; the last: m
    imus: LinkLooks  # (m,) of all


class Rules(NamedTuple):
    """What is known of one body and its sensors beforehand."""

    expected: Expectations
    motion: MotionNumbers
    parents: NDArray[np.int64]  # (links,) of each link; −1 of the root
    limbs: LimbNumbers
    forget_after_s: float  # [s] after which, without IMUs, the filter starts anew
    tracker_delay_s: float  # [s] how late the trackers are
    cameras: int  # how many are looked at: none, or all


class Known(NamedTuple):
    """What is known of the person by now."""

    pose: Pose
    P: FloatArray  # its covariance
    memory: FloatArray  # see :func:`pose_core.kernels.camera.add_camera`
    predicted: Pose  # as it was just before the last update
    shown: Pose  # what went out before the filter has been started anew
    handover: Handover
    instants_ns: NDArray[np.int64]  # (2,) the filter's; the last event's, or NEVER
    heard_ns: NDArray[np.int64]  # (sensors + links,) see :mod:`pose_core.kernels.sources`
    far_since_ns: NDArray[np.int64]  # (1 + limbs,) see :mod:`pose_core.kernels.lost_limbs`
    distance: FloatArray  # (joints,) of the last update, see there
    fit: FloatArray  # (1,) see :mod:`pose_core.kernels.fit`
    last: FloatArray  # (2,) how far the last observation was ahead of the filter [s]; its distance
    counts: NDArray[np.int64]  # (COUNTS,)


@compiled
def follow(
    rules: Rules,
    seen: Seen,
    known: Known,
    out: StateNumbers,
    told: NDArray[np.int64],
    row: int,
    count: int,
    begins: int,
    is_known: bool,
) -> tuple[int, int, int]:
    """Take observations, and keep the states to tell.

    Args:
        rules: What is known beforehand.
        seen: The observations.
        known: What is known of the person; is updated.
        out: Filled: n rows.
        told: Filled: of which observation each of these is, (n,).
        row: The first observation to take.
        count: How many states are kept already.
        begins: How that observation begins.
        is_known: Whether the filter has been started.

    Returns:
        How it ended, at which observation, and how many states are kept.
    """
    while row < len(seen.stamps_ns):
        ended = TAKEN
        if begins == GOING_ON:
            ended = go_on(rules, seen, known, row, is_known)
        if ended == TAKEN and begins != STRAYED_FROM:
            ended = take(rules, seen, known, row, out.information[count])
        if ended < TOO_LATE:
            return ended, row, count
        if ended != TOO_LATE and settle(rules, seen, known, row, begins, ended == REOPENED):
            show(rules, known, out, count)
            told[count] = row
            count += 1
        begins = GOING_ON
        row += 1
    return FOLLOWED, row, count


@compiled
def go_on(rules: Rules, seen: Seen, known: Known, row: int, is_known: bool) -> int:
    """Bring the filter to an observation's instant, as far as it comes after the filter's."""
    ahead_s = (seen.stamps_ns[row] - known.instants_ns[FILTER]) / NS_PER_S
    if -JUMP_BACK_S < ahead_s < -LATEST_S:
        known.counts[FRAMES_TOO_LATE] += 1
        return TOO_LATE
    is_apart = ahead_s <= -JUMP_BACK_S or ahead_s >= rules.forget_after_s
    is_read = seen.first_reading[row] < seen.first_reading[row + 1]
    if not is_known or (is_apart and not is_read):
        return TO_START
    if ahead_s > 0.0:
        predict(rules.expected.body, known.pose, known.P, known.memory, ahead_s, rules.motion)
    return TAKEN


@compiled
def take(rules: Rules, seen: Seen, known: Known, row: int, of_links: FloatArray) -> int:
    """Update the filter by an observation.

    Args:
        rules: What is known beforehand.
        seen: The observations.
        known: What is known of the person; is updated.
        row: Which observation.
        of_links: See :func:`pose_core.kernels.correction.correct`.

    Returns:
        How it ended.
    """
    stamp_ns, instants_ns, counts = seen.stamps_ns[row], known.instants_ns, known.counts
    ahead_s = (stamp_ns - instants_ns[FILTER]) / NS_PER_S
    known.last[AHEAD] = ahead_s
    known.handover.gone_s[0] += min(max(ahead_s, 0.0), rules.forget_after_s)
    if stamp_ns > instants_ns[FILTER] or ahead_s <= -JUMP_BACK_S:
        instants_ns[FILTER] = stamp_ns
    first, last = seen.first_reading[row], seen.first_reading[row + 1]
    imus = LinkLooks(
        seen.imus.links[first:last],
        seen.imus.R_map_link[first:last],
        seen.imus.variance[first:last],
        seen.imus.angular_velocity[first:last],
        seen.imus.rate_variance[first:last],
    )
    # How late the trackers are matters where rates are known: by gyroscopes.
    delay_s = max(-ahead_s, 0.0) + (rules.tracker_delay_s if last > first else 0.0)
    cameras = CameraLooks(
        seen.positions[row, : rules.cameras],
        seen.tracking_state[row, : rules.cameras],
        seen.cameras[row, : rules.cameras],
        seen.offsets[row, : rules.cameras],
        delay_s,
    )
    outcome = correct(
        rules.expected,
        cameras,
        imus,
        known.pose,
        known.P,
        known.memory,
        known.predicted,
        known.distance,
        of_links,
    )
    if not outcome.is_definite:
        return BROKEN
    known.last[TYPICAL] = outcome.typical
    counts[TURNED_BACK] += outcome.flipped
    counts[SIDES_SWAPPED] += outcome.swapped
    lost = find_lost(rules.limbs, known.far_since_ns, stamp_ns, known.distance, outcome.farthest)
    if lost == EVERYTHING:
        return STRAYED
    if lost == NONE:
        return TAKEN
    reopen(rules, known, lost)
    counts[LIMBS_REOPENED] += 1
    return REOPENED


@compiled_in_place
def reopen(rules: Rules, known: Known, lost: int) -> None:
    """Forget what is known of some limbs' rotations: they are elsewhere."""
    links = known.pose.rotations.shape[0]
    rates = len(known.P) - 3 * links
    for limb in range(len(rules.limbs.links)):
        for link in range(links):
            if lost & (1 << limb) and rules.limbs.links[limb, link]:
                forget(known.P, 3 + 3 * link, rules.motion.largest_stddev)
                forget(known.P, rates + 3 * link, REOPENED_RATE_STDDEV)


@compiled
def settle(
    rules: Rules, seen: Seen, known: Known, row: int, begins: int, is_reopened: bool
) -> bool:
    """Have what goes out glide to the corrected state; whether that is to be told.

    Args:
        rules: What is known beforehand.
        seen: The observations.
        known: What is known of the person; is updated.
        row: Which observation was taken.
        begins: How it began.
        is_reopened: Whether a limb was found to be elsewhere.
    """
    stamp_ns, sensors = known.instants_ns[FILTER], seen.tracking_state.shape[1]
    is_event = miss(known.heard_ns, stamp_ns) or is_reopened or begins != GOING_ON
    for sensor in range(sensors):
        if np.any(seen.tracking_state[row, sensor]):
            is_event |= hear(known.heard_ns, sensor, stamp_ns)
    for reading in range(seen.first_reading[row], seen.first_reading[row + 1]):
        is_event |= hear(known.heard_ns, sensors + seen.imus.links[reading], stamp_ns)
    if is_event:
        known.instants_ns[EVENT] = stamp_ns
    event_ns = known.instants_ns[EVENT]
    is_eventful = event_ns != NEVER and 0 <= stamp_ns - event_ns <= EVENT_NS
    if begins == STARTED:
        glide_no_more(known.handover)
    else:
        before = known.shown if begins == STARTED_ANEW else known.predicted
        glide_on(known.handover, before, known.pose, is_eventful)
    ahead_s = known.last[AHEAD]
    if -JUMP_BACK_S < ahead_s < 0.0:
        known.counts[FRAMES_LATE] += 1  # its instant has been told already
        return False
    note_fit(known.fit, max(ahead_s, 0.0), known.last[TYPICAL])
    return True


@compiled
def show(rules: Rules, known: Known, out: StateNumbers, index: int) -> None:
    """Keep what of the state is told, as one row of ``out``."""
    known.handover.at_once[:] = 0.0
    own = StateNumbers(
        out.position[index],
        out.velocity[index],
        out.rotations[index],
        out.rates[index],
        out.turns[index],
        out.shift[index],
        out.place_variance[index],
        out.covariance[index],
        out.information[index],
        out.scale[index],
    )
    scale = scale_of(known.fit)
    keep(known.pose, known.P, rules.parents, known.handover.glide, scale, own)
