"""The fusion node's report in ``/diagnostics``."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from pose_core.api import IMUS, PeoplePipeline, reference_delay_s
from pose_fusion.fusion_lines import assumes_delay, reference_delay_line
from pose_fusion.sample_reader import SampleReader
from pose_fusion.watching.cameras import IMPLAUSIBLE, MISSED_CHECKS, NO_IMUS, UNDECIDED
from pose_node.node_status import Level, Report

T = TypeVar("T")
TRACKING = "tracking"  # the pipeline's status while there are poses
STARTING = "starting: the cameras show the subject, but there is no pose yet"
APART_M = 0.15  # [m] of the cameras' views of the subject; late trackers cause a part of it
DOUBTED = (
    "the subject has come back with other bone lengths: if this is somebody else, stop the graph "
    "and start it again, so that they are measured"
)


class FusionReporter:
    """Reports the state of the tracking, the sensors in use, and the latency."""

    def __init__(self, pipeline: PeoplePipeline, reader: SampleReader) -> None:
        self._pipeline = pipeline
        self._reader = reader
        self._stamp_check, self._watch = reader.check, reader.watch
        self._estimates = 0  # at the last check
        self._missed = 0  # checks in a row without new estimates
        self._too_late = 0  # frames, at the last check
        self._late_checks = 0  # checks in a row with more of them
        self._apart_checks = 0  # checks in a row in which the cameras' views were apart
        self._named: set[str] = set()
        self._unoriented: set[str] = set()  # IMUs whose messages have no orientation
        self.latency_s = 0.0  # [s] of the subject's last estimate

    def check(self) -> bool:
        """Check which sources are usable; return whether this has changed."""
        estimates = self._pipeline.subject.counters["estimates"]
        self._missed = 0 if estimates > self._estimates else self._missed + 1
        self._estimates = estimates
        too_late = self._pipeline.subject.counters.as_dict().get("frames_too_late", 0)
        self._late_checks = self._late_checks + 1 if too_late > self._too_late else 0
        self._too_late = too_late
        self._apart_checks = self._apart_checks + 1 if self._apart_m > APART_M else 0
        is_undecided = self._pipeline.is_undecided
        self._watch.check(self._pipeline.subject_frames, is_undecided=is_undecided)
        self._unoriented = {s for s, is_any in self._reader.oriented.items() if not is_any}
        self._reader.oriented.clear()
        before, self._named = self._named, self._unused_sources()
        return before != self._named

    @property
    def trouble(self) -> frozenset[str]:
        """Sources that were not usable at the last check, and other faults, by name."""
        return frozenset(self._named)

    @property
    def _is_tracking(self) -> bool:
        return self._estimates > 0 and self._missed <= MISSED_CHECKS

    @property
    def _apart_m(self) -> float:
        """How far the views of the subject that are farthest from the pose are apart [m]."""
        return sum(sorted(self._pipeline.subject.views_apart_m.values())[-2:])

    def _unused_sources(self) -> set[str]:
        subject = self._pipeline.subject
        checked = subject.imus.orientations
        imus = {*self._silent_imus, *self._unoriented, *checked.jumping, *checked.saturated}
        imus |= {use.segment for use in subject.imu_uses if use.reason}
        imus |= {f"{name}'s segment" for name in self._exchanged}
        imus |= {f"{name}'s field" for name in subject.imus.walks.disturbed}
        imus |= {f"{name}'s rate" for name in subject.imus.contradicted_rates}
        names = {f"{sensor}'s names" for sensor in self._watch.faulty}
        names |= {f"{sensor}'s joints" for sensor in self._held_joints}
        missing = {*self.excluded, *self._watch.missing, *imus, *names}
        if self._late_checks > MISSED_CHECKS:
            missing.add("late frames")
        if self._apart_checks > MISSED_CHECKS:
            missing.add("views")
        if subject.imus_late_s:
            missing.add("the IMUs' clock")
        if self._pipeline.is_doubted:
            missing.add("the subject's size")
        return missing if self._is_tracking else {*missing, "everything"}

    def report(
        self,
        unused: Sequence[str],
        malformed: Mapping[str, str],
        lost: Mapping[str, int],
        publishers: Mapping[str, int] | None = None,
        clock_trouble: str = "",
        unheard_imus: Sequence[str] = (),
        unread_imus: Mapping[str, str] = MappingProxyType({}),
    ) -> Report:
        """The report as of the last check.

        Args:
            unused: Names of sensors that publish and are not used.
            malformed: Errors in the last messages of other topics, by topic.
            lost: Number of messages lost since the last report, by source.
            publishers: Number of publishers of each topic that has several.
            clock_trouble: What is wrong with simulated time.
            unheard_imus: Segments whose IMU's topic has a publisher, but not yet a message.
            unread_imus: Why IMUs that are published are not read, by segment or topic; no fault.
        """
        has_subject = self._pipeline.status == TRACKING
        is_ok = has_subject and not (
            self._unused_sources()
            or malformed
            or lost
            or publishers
            or clock_trouble
            or unheard_imus
        )
        status = self._tracking()
        remarks = [
            *([DOUBTED] if self._pipeline.is_doubted else []),
            *_publisher_remarks(publishers or {}),
            *self._camera_remarks(),
            *(self._unused_imus() if status in (TRACKING, STARTING) else ()),
            *self._imu_remarks(unheard_imus),
            *self._late_remarks(),
            *filter(None, [reference_delay_line(self._pipeline)]),
            *_graph_remarks(malformed, lost, self._pipeline.others, unused),
            *(f"IMUs not used: {', '.join(imus)}: {why}" for why, imus in _by_reason(unread_imus)),
        ]
        if clock_trouble:  # the sources' stamps and silence follow from it
            remarks = [f"use_sim_time is true, and {clock_trouble}"]
        return Report(
            level=Level.OK if is_ok else Level.WARN,
            message="; ".join([status, *remarks]),
            values={**self._values(), "sensors_not_used": ", ".join(unused) or "none"},
        )

    def _tracking(self) -> str:
        status = self._pipeline.status
        if status == TRACKING and not self._is_tracking:
            others = [
                name for name in self._pipeline.people if name != self._pipeline.parameters.subject
            ]
            if others:
                return f"the subject is out of view; in view: {', '.join(others)}"
            if self._pipeline.is_undecided:
                return UNDECIDED
            if self._pipeline.parameters.estimator == "imu" and not self._pipeline.imu_samples:
                return f"{NO_IMUS}: the estimator imu needs them (imu_<segment>/data)"
            seen = self._pipeline.subject_frames.keys() - self._watch.missing.keys()
            return STARTING if seen else "no skeletons: the sensors see nobody, or are silent"
        return status

    @property
    def _silent_imus(self) -> Sequence[str]:
        """IMUs that send nothing: for others without usable samples there is another reason."""
        silent = self._pipeline.subject.silent_imus if self._pipeline.parameters.use_imus else ()
        sending = {*self._unoriented, *(name.removeprefix(f"{IMUS}/") for name in self.excluded)}
        return [name for name in silent if name not in sending]

    def _unused_imus(self) -> Iterator[str]:
        """IMUs that are not used, and why; not those that another remark gives the reason of."""
        checked = self._pipeline.subject.imus.orientations
        unusable = {*self._silent_imus, *self._unoriented, *checked.jumping, *checked.saturated}
        unusable |= {name.removeprefix(f"{IMUS}/") for name in self.excluded}
        uses = self._pipeline.subject.imu_uses
        reasons = {u.segment: u.reason for u in uses if u.reason and u.segment not in unusable}
        for reason, segments in _by_reason(reasons):
            verb = "IMU on {} is" if len(segments) == 1 else "IMUs on {} are"
            yield f"the {verb.format(', '.join(segments))} not used: {reason}"

    @property
    def _exchanged(self) -> Sequence[str]:
        """Segments whose IMU is worn on another one."""
        return [use.segment for use in self._pipeline.subject.imu_uses if use.exchanged_with]

    @property
    def _held_joints(self) -> Mapping[str, Sequence[str]]:
        """Joints of the subject that cameras hold, of cameras that do."""
        held = self._pipeline.subject.held_joints.held
        return {sensor: joints for sensor, joints in held.items() if joints}

    @property
    def excluded(self) -> Mapping[str, str]:
        """Sources whose stamps are implausible, and why; not cameras that see nobody by now."""
        found = self._stamp_check.excluded if self._stamp_check is not None else {}
        missing = self._watch.missing
        return {
            name: why
            for name, why in found.items()
            if missing.get(name, IMPLAUSIBLE) == IMPLAUSIBLE
        }

    def _camera_remarks(self) -> Iterator[str]:
        """Sources with implausible stamps, and cameras whose frames are of little use."""
        excluded = self.excluded
        for why, named in _by_reason(excluded):
            verb, whose = ("is", "its") if len(named) == 1 else ("are", "their")
            yield f"{', '.join(named)} {verb} not used: {whose} {why}"
        for sensor, why in self._watch.missing.items():
            if sensor not in excluded:
                yield f"{sensor} does not show the subject: {why}"
        for sensor, why in self._watch.faulty.items():
            yield f"{sensor}: {why}"
        if self._apart_checks > MISSED_CHECKS and not self._pipeline.is_doubted:
            what = f"the cameras' views are {self._apart_m:.1f} m apart"
            yield f"{what}: calibrate again if one has been moved"
        for sensor, joints in self._held_joints.items():
            what = "it repeats their positions: they are not used"
            yield f"{sensor} holds {', '.join(joints)}: {what}"

    def _imu_remarks(self, unheard: Sequence[str]) -> Iterator[str]:
        """Faults of IMUs, each with the segments of all that have it."""
        imus = self._pipeline.subject.imus
        named = {
            "the IMU on {} is published, but has sent nothing yet: check its battery and radio": (
                unheard
            ),
            "the IMU on {} has sent nothing for 0.2 s or more: check its battery, radio and rate": (
                self._silent_imus
            ),
            "the messages of the IMU on {} have no orientation (NaN, zero, or covariance -1): "
            "let its driver send it": sorted(self._unoriented),
            "the gyroscope of the IMU on {} is saturated: set a larger range on the sensor; it is "
            "used 2 s after": imus.orientations.saturated,
            "the orientation of the IMU on {} contradicts its gyroscope: check its strap, its "
            "segment and the device": imus.orientations.jumping,
            "the heading of the IMU on {} wanders, and counts less: keep it from metal and motors, "
            "and tighten its strap": imus.walks.disturbed,
            "the IMUs of {} are exchanged, and used as they are worn: exchange them on the body, "
            "or in the nodes file": self._exchanged,
        }
        for remark, segments in named.items():
            if segments:
                yield remark.format(", ".join(segments))
        for fault, segments in _by_reason(imus.contradicted_rates):
            yield f"the angular velocity of the IMU on {', '.join(segments)} {fault}"

    def _late_remarks(self) -> Iterator[str]:
        if self._late_checks > MISSED_CHECKS:
            what = "too long after newer ones (0.2 s, at first 0.03 s), and are not used"
            yield f"frames of cameras come {what}: check their machines' load and clocks"
        if late_s := self._pipeline.subject.imus_late_s:
            late = f"about {1000.0 * late_s:.0f} ms later than the cameras' frames"
            yield f"the IMUs' samples come {late}: check their radio and their clocks"

    def _values(self) -> dict[str, object]:
        pipeline, subject = self._pipeline, self._pipeline.subject
        uses = subject.imu_uses
        return {
            "subject": pipeline.parameters.subject,
            "estimator": pipeline.parameters.estimator,
            "sensors": ", ".join(pipeline.parameters.sensors),
            "latency_s": f"{self.latency_s:.4f}",
            **self._reader.stages.as_dict(),
            **{
                f"clock_ahead_ms/{source}": f"{clock.ahead_ns(clock.at_ns) * 1e-6:.1f}"
                for source, clock in pipeline.clocks.items()
            },
            **{
                f"tracker_delay_ms/{sensor}": f"{1e3 * delay_s:.0f} ± {1e3 * stddev_s:.0f}"
                for sensor, (delay_s, stddev_s) in subject.tracker_delays_s.items()
            },
            **self._reference_delay(),
            "imus": ", ".join(subject.imus.segments) or "none",
            **{
                f"heading_leapt_deg/{segment}": f"{-np.degrees(heading):.1f}"
                for segment, heading in subject.imus.orientations.headings.items()
            },
            "imus_aligned": ", ".join(u.segment for u in uses if u.is_aligned) or "none",
            **{f"imu/{use.segment}": str(use) for use in uses},
            **subject.counters.as_dict(),
            **subject.imus.counters.as_dict(),
            **self._reader.counters.as_dict(),
            **self._clocks(),
            "people": ", ".join(pipeline.people) or "none",
            "people_not_tracked": pipeline.others,
            **{f"people/{name}": count for name, count in pipeline.people_counts.items()},
            **subject.aligner.counters.as_dict("alignment/"),
        }

    def _reference_delay(self) -> dict[str, object]:
        """By how much the poses are before the reference's stamps [ms], if no IMU measures it."""
        if not assumes_delay(self._pipeline):
            return {}
        known_s = self._pipeline.parameters.tracker_delay
        delay_s = known_s or reference_delay_s(self._pipeline.clocks)
        return {"reference_delay_ms": f"{1e3 * delay_s:.0f}"}

    def _clocks(self) -> dict[str, object]:
        """Excluded sources, and corrections of clocks that have jumped."""
        if self._stamp_check is None:
            return {}
        excluded = "; ".join(f"{source}: {why}" for source, why in self.excluded.items())
        corrected = self._stamp_check.offsets_s.items()
        return {
            "sources_set_aside": excluded or "none",
            **{f"clock_leapt_s/{source}": f"{-offset_s:.3f}" for source, offset_s in corrected},
            **self._stamp_check.counters.as_dict(),
        }


def _by_reason(reasons: Mapping[str, T]) -> Iterator[tuple[T, list[str]]]:
    """Each reason, with the names of all that have it."""
    for reason in dict.fromkeys(reasons.values()):
        yield reason, [name for name, own in reasons.items() if own == reason]


def _publisher_remarks(publishers: Mapping[str, int]) -> Iterator[str]:
    """Topics that several nodes publish, by their number."""
    for count, topics in _by_reason(publishers):
        yield f"{count} publishers of {', '.join(topics)}: started twice? Stop all but one"


def _graph_remarks(
    malformed: Mapping[str, str], lost: Mapping[str, int], others: int, unused: Sequence[str]
) -> Iterator[str]:
    """What the graph has, but the fusion does not use."""
    for topic, why in malformed.items():
        yield f"{topic} is not used: {why}"
    if lost:
        count, sources = sum(lost.values()), ", ".join(lost)
        yield f"{count} messages of {sources} were lost: the machine is too busy"
    if others:
        yield f"{others} more people in view, not tracked"
    if unused:
        yield f"not used: {', '.join(unused)}, add it to sensors"
