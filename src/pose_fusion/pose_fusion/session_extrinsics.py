"""The sensors of a recorded bag and their extrinsics, for the offline tools."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

from pose_calibration.files.extrinsics_file import load_extrinsics, load_extrinsics_of
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.session_calibration import calibrate_people, complete, moved_sensors
from pose_core.api import Extrinsics, extrinsics_from_map
from pose_core.errors import InputError
from pose_fusion.calibration_lines import clocks_line, extrinsics_lines
from pose_io.bag_samples import BagFrames, read_extrinsics
from pose_io.bags import BagReader
from pose_io.clock_messages import read_clocks
from pose_io.topics import sensor_topics

MOTION = "the motion in the bag"

Say: TypeAlias = Callable[[str], object]
"""Takes a line to the user."""


def checked_sensors(
    bag: BagReader, wanted: Sequence[str] = (), extrinsics_file: str = ""
) -> tuple[str, ...]:
    """The wanted sensors, or all of the bag's if none is named, in the order of the file.

    Raises:
        InputError: If the bag holds no skeletons, or none of a wanted sensor.
    """
    found = tuple(sensor_topics(bag))
    if not found:
        BagFrames(bag)  # raises an error that names what is missing
    missing = [name for name in wanted if name not in found]
    if missing:
        raise InputError(
            f"{bag.path} holds no skeletons of {', '.join(missing)}: it has {', '.join(found)}; "
            "name them with --sensors"
        )
    if extrinsics_file and not wanted:
        in_file = load_extrinsics(Path(extrinsics_file)).sensors
        return in_file if set(in_file) == set(found) else found
    return tuple(wanted) or found


def recorded_extrinsics(bag: BagReader, sensors: Sequence[str]) -> Extrinsics | None:
    """Extrinsics from the bag's transforms, with its clocks; None if a sensor has no transform."""
    placed = read_extrinsics(bag)
    if any(sensor not in placed for sensor in sensors):
        return None
    found = extrinsics_from_map({sensor: placed[sensor] for sensor in sensors})
    return replace(found, clocks=read_clocks(bag))


def find_extrinsics(
    bag: BagReader,
    sensors: tuple[str, ...],
    say: Say,
    extrinsics_file: str = "",
    *,
    imus: bool = True,
) -> Extrinsics:
    """Extrinsics from the file, else from the bag's transforms, else from its motion.

    What the first two lack, clocks and body measures, comes from the motion, too. The vertical
    comes from IMUs, too, unless they are not to be used.
    """
    known: Extrinsics | None
    if extrinsics_file:
        of_all = load_extrinsics(Path(extrinsics_file))
        if set(sensors) < set(of_all.sensors):  # clocks may be relative to one that is not used
            placed = {sensor: of_all.T_map_sensor(sensor) for sensor in sensors}
            known = replace(extrinsics_from_map(placed), body=of_all.body)
        else:
            known = load_extrinsics_of(Path(extrinsics_file), sensors)
        known = known if known.clocks else replace(known, clocks=read_clocks(bag))
    else:
        known = recorded_extrinsics(bag, sensors)
        if known is None:
            one = len(sensors) == 1
            what = "the camera's tilt and height" if one else "them"
            say(f"extrinsics: none in the bag, estimating {what} from its motion")
            session = calibrate_people(BagFrames(bag, imus=imus), sensors)
            lines = (session.people_line, *extrinsics_lines(session.extrinsics, MOTION))
            for line in filter(None, (*lines, *map(str, session.moved))):
                say(line)
            return session.extrinsics
        say("extrinsics: from the bag's /tf_static")
    return _complete_from_motion(bag, known, say, imus=imus)


def _complete_from_motion(bag: BagReader, known: Extrinsics, say: Say, *, imus: bool) -> Extrinsics:
    """Add what known extrinsics lack; say which clocks are used, and which sensor was moved."""
    is_incomplete = not known.clocks or known.body is None
    frames, found = list(BagFrames(bag, imus=imus and is_incomplete)), known
    if is_incomplete:
        try:
            found = complete(frames, known)
        except CalibrationError as error:
            say(f"clocks and body measures: not estimated from the motion ({error})")
    if found.clocks:
        source = "as recorded" if known.clocks else f"by {MOTION}"
        say(clocks_line(found, source))
    for moved in moved_sensors(frames, found):
        say(str(moved))
    return found
