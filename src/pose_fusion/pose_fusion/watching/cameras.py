"""Which cameras show the subject, and why the others do not."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from pose_core.api import RepeatedFrames, SkeletonSample

MISSED_CHECKS = 2  # [checks] in a row without the subject, after which a camera is named
ELSEWHERE = "it shows nobody at the subject's position: check its pose, units and joints"
NO_IMUS = "no IMUs"
UNDECIDED = "it is not decided yet who is in view"
IMPLAUSIBLE = "its stamps are implausible"
SILENT = "it is silent: check its node and its cable"


@dataclass
class _Camera:
    frames: int = 0  # since the last check, of any kind
    trouble: str = ""  # with the last one of them
    fault: str = ""  # in the names or positions of one of them, since the last check
    fault_before: str = ""  # the same, at the last check
    shown: int = 0  # frames of the subject, at the last check
    missed: int = 0  # checks in a row in which there were no more


class CameraWatch:
    """Notes each camera's frames; checks at intervals which of them show the subject."""

    def __init__(self, sensors: Collection[str]) -> None:
        self._cameras = {sensor: _Camera() for sensor in sensors}
        self._repeated = RepeatedFrames()
        self.missing: dict[str, str] = {}
        """Cameras that do not show the subject as of the last check, and why."""
        self.faulty: dict[str, str] = {}
        """Other cameras whose messages have wrong names or positions, and which."""

    def note_fault(self, sensor: str, fault: str) -> None:
        """A message has come with wrong names or positions."""
        self._cameras[sensor].fault = fault

    def note_trouble(self, sensor: str, trouble: str) -> None:
        """A message has come that is of no use."""
        self._cameras[sensor].frames += 1
        self._cameras[sensor].trouble = trouble

    def note_frame(self, sensor: str, persons: Sequence[SkeletonSample]) -> bool:
        """A frame has come; whether it is of use: not one that is repeated again and again."""
        is_frozen = self._repeated.is_frozen(sensor, persons)
        if is_frozen:
            self.note_trouble(sensor, "it repeats one frame: restart its tracker")
        elif any(person.tracking_state.any() for person in persons):
            self.note_trouble(sensor, ELSEWHERE)
        else:
            self.note_trouble(sensor, "it sees nobody")
        if self._repeated.is_still(sensor):
            self.note_fault(sensor, "all its frames have been alike: does its tracker run?")
        return not is_frozen

    def check(self, shown: Mapping[str, int], *, is_undecided: bool = False) -> None:
        """Find out which cameras do not show the subject.

        Args:
            shown: Number of frames of the subject that were used, by camera.
            is_undecided: Whether it is not decided yet who somebody in view is.
        """
        self.missing, self.faulty = {}, {}
        for sensor, camera in self._cameras.items():
            count = shown.get(sensor, 0)
            camera.missed = 0 if count != camera.shown else camera.missed + 1
            camera.shown = count
            if camera.missed >= MISSED_CHECKS and any(shown.values()):
                why = camera.fault or camera.trouble if camera.frames else SILENT
                self.missing[sensor] = UNDECIDED if is_undecided and why == ELSEWHERE else why
            elif camera.fault and camera.fault == camera.fault_before:
                self.faulty[sensor] = camera.fault
            camera.frames, camera.fault_before, camera.fault = 0, camera.fault, ""
