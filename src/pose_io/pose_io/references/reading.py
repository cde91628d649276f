"""Reading a reference of any kind, recognised by its path."""

from pathlib import Path

from pose_core.errors import InputError
from pose_io.bag_samples import read_body_series
from pose_io.bags import BAG_SUFFIXES, BagReader, open_bag
from pose_io.names import ABOUT_TOPIC, TRUTH_NAMESPACE
from pose_io.references.c3d_file import read_c3d
from pose_io.references.markers import skeleton_of_markers
from pose_io.references.mot import read_mot
from pose_io.references.reference import Reference, reference_of_skeleton
from pose_io.references.trc import read_trc
from pose_io.references.uiprmd import read_uiprmd
from pose_io.references.vicon_csv import read_vicon_csv
from pose_io.topics import body_topic

MARKER_READERS = {".csv": read_vicon_csv, ".c3d": read_c3d, ".trc": read_trc}
ANGLE_READERS = {".mot": read_mot, ".sto": read_mot}
UIPRMD_NAME = "_positions.txt"  # ending of a repetition's file of that public data set


def read_reference(path: Path) -> Reference:
    """Read the reference that a recording is compared with.

    Args:
        path: A bag with a body's skeleton (the truth of a synthetic subject, or a fused one), a
            Vicon CSV, a C3D, TRC, MOT or STO file.

    Raises:
        InputError: If it is none of these, or damaged.
    """
    if not path.exists():
        raise InputError(f"found no reference at {path}")
    suffix = path.suffix.lower()
    if path.is_dir() or suffix in BAG_SUFFIXES:
        with open_bag(path) as bag:
            return reference_of_bag(bag)
    if suffix in ANGLE_READERS:
        return ANGLE_READERS[suffix](path)
    if suffix in MARKER_READERS:
        markers = MARKER_READERS[suffix](path)
        return reference_of_skeleton(path.name, skeleton_of_markers(markers, str(path)))
    if UIPRMD_NAME in path.name:
        return read_uiprmd(path)
    known = ", ".join([*MARKER_READERS, *ANGLE_READERS])
    raise InputError(f"{path} is not a reference: expected a bag or one of {known}")


def reference_of_bag(bag: BagReader) -> Reference:
    """The true skeleton in a bag of a synthetic subject, else its fused skeleton.

    Raises:
        InputError: If the bag contains neither.
    """
    is_truth = body_topic(bag, "skeleton", namespace=TRUTH_NAMESPACE) is not None
    skeleton = read_body_series(bag, namespace=TRUTH_NAMESPACE if is_truth else "")
    return reference_of_skeleton(
        "the simulated truth" if is_truth else f"the fused skeleton of {bag.path.name}",
        skeleton,
        synthetic=is_truth and ABOUT_TOPIC in bag.topics,
    )
