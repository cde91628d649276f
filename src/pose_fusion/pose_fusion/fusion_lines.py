"""Lines of text about a fusion, for the tool that runs one."""

from collections.abc import Iterable, Iterator, Mapping

from pose_core.api import (
    UNKNOWN_DELAY_S,
    USUAL_DELAY_S,
    BodyShape,
    PeoplePipeline,
    Pipeline,
    earlier_than_reference_s,
    estimator_class,
    reference_delay_s,
)
from pose_core.stamps import NS_PER_S

FAULTS = {
    "frames_too_late": "{} frames came too late and were not used: see the clocks of their sensors",
    "filter_restarts_backwards": "the pose faced backwards until bent knees showed it, {} times: "
    "see where a camera has the person's back and loses joints",
    "filter_restarts_crossed": "the pose's legs or arms were exchanged until all cameras "
    "contradicted it, {} times: see where a tracker exchanges them",
}
"""Lines by the counter of a fault."""
NOTABLE_SWAPS = 0.1  # [-] share of frames with exchanged sides from which on they are named
NOTABLE_S = 0.005  # [s] by which poses are earlier than the stamps, from which on it is said


def closing_lines(pipeline: PeoplePipeline, unread: Iterable[str]) -> Iterator[str]:
    """What became of a recording's data.

    Args:
        pipeline: At the recording's end.
        unread: Segments whose IMUs were not to be read.
    """
    subject = pipeline.subject
    yield from people_lines(pipeline)
    yield from repeated_lines(pipeline)
    yield from fault_lines(subject.counters.as_dict())
    yield from body_lines(subject.shape)
    yield from missing_lines(subject)
    yield from delay_lines(pipeline)
    yield from (f"IMU {name}: not used, use_imus is false: set it to true" for name in unread)
    yield from (f"IMU {use}" for use in subject.imu_uses)


def people_lines(pipeline: PeoplePipeline) -> Iterator[str]:
    """Who was there, whose pose was estimated; nothing where one person was alone."""
    counts = pipeline.people_counts
    appeared = counts["appeared"]
    if appeared < 2:
        return
    for body_id, count in pipeline.estimates.items():
        yield f"{body_id}: {count} estimates"
    if changes := counts["subject_changed"]:
        anew = ": the IMUs were aligned anew" if pipeline.imu_samples else ""
        yield (
            "people: who came back was somebody else by their bone lengths (times: "
            f"{changes}; feet outside the picture give wrong ones){anew}"
        )
    others = counts["skeletons_of_others"]
    rule = pipeline.parameters.person
    if others and pipeline.most_at_once == 1:
        yield (
            f"people: no camera saw two at once, but {others} skeletons were elsewhere, and were "
            "not used: of others who came in turn, or of one person whom a camera shows elsewhere "
            "(see its extrinsics, and whether it was moved)"
        )
    elif others:
        yield (
            f"people: {appeared}; chosen: {rule}; not used: {others} skeletons of others "
            f"(--max-people {min(appeared, 6)}, or --person nearest, imus, a sensor's id)"
        )


def repeated_lines(pipeline: PeoplePipeline) -> Iterator[str]:
    """Which cameras repeated one frame."""
    for sensor, count in sorted(pipeline.repeated_frames.items()):
        yield (
            f"{sensor}: {count} frames left out: its tracker repeats one frame exactly: "
            "restart it before the next recording"
        )


def fault_lines(counts: Mapping[str, int]) -> Iterator[str]:
    """What went wrong, and what was done about it."""
    for name, line in FAULTS.items():
        if counts.get(name, 0):
            yield line.format(counts[name])
    if counts.get("sides_swapped", 0) > NOTABLE_SWAPS * counts["frames"]:
        yield (
            f"trackers exchanged left and right of {counts['sides_swapped']} pairs of limbs in "
            f"{counts['frames']} frames, which were put right: turn off their mirroring, or see "
            "that they see the person's front"
        )


def missing_lines(subject: Pipeline) -> Iterator[str]:
    """Which joints no camera tracked, though others of their kind were measured."""
    assumed = () if subject.shape is None else subject.shape.assumed
    if missing := [name for name in subject.tracked_joints.missing if name not in assumed]:
        yield (
            f"joints that no camera tracks: {', '.join(missing)}: the angles there are guesses, "
            "with large standard deviations"
        )


def delay_lines(pipeline: PeoplePipeline) -> Iterator[str]:
    """How late each camera's tracker is; without IMUs, how late the reference's probably is."""
    if not pipeline.imu_samples:
        yield from filter(None, [reference_delay_line(pipeline)])
        return
    delays_s = pipeline.subject.tracker_delays_s
    for sensor, (delay_s, stddev_s) in delays_s.items():
        if stddev_s < UNKNOWN_DELAY_S:
            line = f"tracker of {sensor}: delay {1e3 * delay_s:.0f} ± {1e3 * stddev_s:.0f} ms"
            if sensor in pipeline.clocks:  # a delay and a clock's offset look alike
                offset_s = pipeline.clocks[sensor].offset_ns / NS_PER_S
                by_stamps = f"{round(1e3 * (delay_s + offset_s))} ms by its own stamps"
                line += f" after the correction of its clock, {by_stamps}"
            if delay_s - stddev_s > USUAL_DELAY_S:
                line += ": longer than usual, or the IMUs' clock is behind, which looks alike"
            yield line
        else:
            why = (
                "too little motion at the end, limbs that are late by different times (a tracker "
                "that smooths, straps that swing), or clocks of the IMUs that differ"
            )
            yield f"tracker of {sensor}: delay not known: {why}"
    if any(stddev_s < UNKNOWN_DELAY_S for _, stddev_s in delays_s.values()):
        yield (
            "delays are relative to the IMUs' stamps: if those are late or on another clock, the "
            "poses are by as much"
        )
    if late_s := pipeline.subject.imus_late_s:
        yield f"IMUs: at the end, {1e3 * late_s:.0f} ms later than the frames: see their clocks"


def assumes_delay(pipeline: PeoplePipeline) -> bool:
    """Whether the estimator corrects a delay of the trackers that no IMU measures."""
    corrects = estimator_class(pipeline.parameters.estimator).ALIGNS_IMUS  # the default's alone
    return corrects and not pipeline.imu_samples


def reference_delay_line(pipeline: PeoplePipeline) -> str:
    """By how much poses without IMUs are before the reference's stamps, or may be late."""
    if pipeline.parameters.tracker_delay or not assumes_delay(pipeline):
        return ""
    late_s = reference_delay_s(pipeline.clocks)
    earlier_s = earlier_than_reference_s(pipeline.clocks)
    if late_s > NOTABLE_S:
        return (
            f"poses: {1e3 * late_s:.0f} ms before the reference's stamps, whose tracker is "
            "probably late, as another camera seems earlier; its clock may differ instead: "
            "the parameter tracker_delay says how late it is"
        )
    if earlier_s > NOTABLE_S:
        return (
            "poses: at the reference's stamps, though another camera seems "
            f"{1e3 * earlier_s:.0f} ms earlier: their clocks differ, or the reference's "
            "tracker is late by that much (does it smooth?), which the parameter tracker_delay "
            "corrects"
        )
    return ""


def body_lines(shape: BodyShape | None) -> Iterator[str]:
    """Which joints could not be measured, so that they have an average body's proportions."""
    if shape is not None and shape.assumed:
        yield (
            f"body: {', '.join(shape.assumed)} not measured, since they, or the hips and neck "
            "they are measured from, are hardly ever tracked: bone lengths of an average body of "
            "this size; angles of what is not seen are what IMUs and posture tell"
        )
