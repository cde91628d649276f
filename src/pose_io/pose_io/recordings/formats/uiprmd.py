"""UI-PRMD's Kinect files: one Kinect v2, one repetition of a rehabilitation exercise per file.

Vakanski, Jun, Paul, Baker (2018), A Data Set of Human Body Movements for Physical Rehabilitation
Exercises, Data 3(1):2. A row is a frame at 30 Hz, without a header, a time or a tracking state: 22
joints × 3 numbers. ``…_positions.txt`` contains the waist's position [cm] and every other joint's
offset in its parent's axes; ``…_angles.txt`` beside it each joint's rotation relative to its
parent [deg], as angles about x, y and z. The joints' positions follow from both:

    R_j = R_parent R_z(γ_j) R_x(α_j) R_y(β_j),    p_j = p_parent + R_parent offset_j          (1)

The order of the three rotations was found from the data: this one keeps the feet of people who
squat on the floor, and agrees with the Vicon's hip angles; the others do not.
"""

import itertools
from pathlib import Path

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import SIDES, TrackingState
from pose_core.stamps import NS_PER_S
from pose_io.recordings.formats.format import Format
from pose_io.recordings.formats.number_tables import read_numbers
from pose_io.recordings.joint_maps import JointMap
from pose_io.recordings.recording import Recording, make_recording, make_stream

FRAME_RATE = 30.0  # [Hz] of a Kinect v2
SENSOR, PERSON = "kinect", "subject"
POSITIONS, ANGLES = "positions", "angles"  # how folders and files are named

CHAINS = (
    ("Waist", "Spine", "Chest", "Neck", "Head", "HeadTip"),
    *(("Chest", f"{s}Collar", f"{s}UpperArm", f"{s}Forearm", f"{s}Hand") for s in "LR"),
    *(("Waist", f"{s}UpperLeg", f"{s}LowerLeg", f"{s}Foot", f"{s}Toes") for s in "LR"),
)
PARENTS: dict[str, str | None] = {
    "Waist": None,
    **{joint: parent for chain in CHAINS for parent, joint in itertools.pairwise(chain)},
}
"""The file's joints in its order, and the joint whose axes their offset is given in."""

JOINT_MAP = JointMap(
    sensor="UI-PRMD",
    joints=tuple(PARENTS),
    sources={
        "head": ("HeadTip",),  # 20 cm above the chest, where Kinect v2 has its head
        "neck": ("Chest",),  # between the shoulders
        "torso": ("Spine",),
        **{
            f"{side}_{ours}": (f"{side[0].upper()}{theirs}",)
            for side in SIDES
            for ours, theirs in (
                ("shoulder", "UpperArm"),
                ("elbow", "Forearm"),
                ("hand", "Hand"),
                ("hip", "UpperLeg"),
                ("knee", "LowerLeg"),
                ("foot", "Foot"),
            )
        },
    },
    R_optical_sdk=np.diag([1.0, -1.0, -1.0]),  # x right, y up, z towards the sensor
    unit_m=0.01,
)


def read(path: Path) -> Recording:
    """Read a file of positions and the angles that belong to it, see :class:`Format`."""
    offsets = _read_triples(path)
    angles = _read_triples(angles_path(path))
    if len(offsets) != len(angles):
        raise InputError(
            f"{path} has {len(offsets)} frames, {angles_path(path)} {len(angles)}: "
            "expected two files of one repetition"
        )
    tracked = np.full(offsets.shape[:2], TrackingState.TRACKED, np.uint8)
    positions, state = JOINT_MAP.convert(joint_places(offsets, angles), tracked)
    stream = make_stream(
        SENSOR,
        host_time_ns=np.rint(np.arange(len(positions)) * (NS_PER_S / FRAME_RATE)).astype(np.int64),
        sensor_time_ns=None,
        person=[PERSON] * len(positions),
        positions=positions,
        tracking_state=state,
    )
    return make_recording(str(path), "uiprmd", [stream])


def angles_path(path: Path) -> Path:
    """The file of angles that belongs to a file of positions.

    Raises:
        InputError: If the file is not named as one of positions.
    """
    if POSITIONS not in path.name:
        raise InputError(
            f"{path} is not named …_{POSITIONS}.txt: name UI-PRMD's file of positions, the angles "
            "are found beside it"
        )
    folder = path.parent
    if folder.name == POSITIONS.title():
        folder = folder.with_name(ANGLES.title())
    return folder / path.name.replace(POSITIONS, ANGLES)


def joint_places(offsets: FloatArray, angles: FloatArray) -> FloatArray:
    """Joint positions by (1).

    Args:
        offsets: As in the file [cm], shape (n, 22, 3).
        angles: As in the file [deg], shape (n, 22, 3).

    Returns:
        Positions in the file's world frame [cm], shape (n, 22, 3).
    """
    # Imported here: scipy takes half a second to load, and only these recordings need it.
    from scipy.spatial.transform import Rotation

    places: dict[str, FloatArray] = {}
    rotations: dict[str, Rotation] = {}
    for number, (name, parent) in enumerate(PARENTS.items()):
        rotation = Rotation.from_euler("ZXY", angles[:, number][:, [2, 0, 1]], degrees=True)
        place = offsets[:, number]
        if parent is not None:  # (1)
            rotation = rotations[parent] * rotation
            place = places[parent] + rotations[parent].apply(place)
        rotations[name], places[name] = rotation, place
    return np.stack(list(places.values()), axis=1)


def _read_triples(path: Path) -> FloatArray:
    """Three finite numbers for each joint, shape (n, 22, 3)."""
    numbers = read_numbers(path, 3 * len(PARENTS), "22 joints × 3, positions or angles")
    if not np.isfinite(numbers).all():
        raise InputError(f"{path} holds NaN or infinity: expected only finite numbers")
    return numbers.reshape(len(numbers), len(PARENTS), 3)


def recognise(path: Path, _begin: bytes) -> bool:
    """Whether a file has the name of a file of positions, with its file of angles beside it."""
    is_named = path.name.endswith((f"_{POSITIONS}.txt", f"_{POSITIONS}.txt.gz"))
    return is_named and angles_path(path).is_file()


FORMAT = Format(read=read, recognise=recognise)
