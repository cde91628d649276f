"""Persons read from the bytes of ``pose_msgs/SkeletonArray``, many messages at once.

A tracker's messages have the same length and names, and differ in their numbers only. The offsets
of the numbers are found once for each such form.
"""

from collections import Counter, defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from pose_core.api import SkeletonSample
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_core.kernels.compiling import type_specialised
from pose_io.arrays import ByteArray, IntArray
from pose_io.cdr.kernels import HEADER_SIZE, MAX_RANGE, PersonPlaces, have_form, read_person
from pose_io.cdr.layout import Walker
from pose_io.names import SKELETON_ARRAY, sensor_frame

BEST_STATE = int(max(TrackingState))
FORMS_KEPT = 16  # bounds the memory: persons leave, and new ids arrive
FORM_BYTES_KEPT = 4_194_304  # [bytes] of all stored forms
NO_POSITION = (
    f"no joint that it tracks has a position: NaN, zero or beyond {MAX_RANGE:g} m; is it in "
    "millimetres? The unit is metres"
)
MAX_MESSAGE = 262_144  # [bytes] 200 persons of 25 joints

Persons = list[SkeletonSample]
_have_form, _read_person = type_specialised(have_form), type_specialised(read_person)


@dataclass(frozen=True, kw_only=True)
class _Form:
    is_little: bool
    fixed: IntArray  # offsets of the constant bytes
    texts: ByteArray  # those bytes
    persons: tuple[tuple[str, PersonPlaces], ...]  # by their ids
    fault: str  # what is wrong with its names; empty if nothing is


class SkeletonReader:
    """Reads one sensor's messages."""

    def __init__(self, sensor: str) -> None:
        self.fault = ""
        """What is wrong with the names or positions in the last messages; empty if nothing is."""
        self.faults: Counter[str] = Counter()
        """Such faults so far, with the number of messages that had them."""
        self._sensor = sensor
        self._forms: dict[int, list[_Form]] = defaultdict(list)
        self._form_bytes = 0

    def read(self, datas: Sequence[bytes]) -> list[Persons | InputError]:
        """The persons of each message, or its error.

        Joints that a message does not contain are NaN and NOT_TRACKED.
        """
        result: list[Persons | InputError] = [[] for _ in datas]
        by_length: dict[int, list[int]] = defaultdict(list)
        for index, data in enumerate(datas):
            by_length[len(data)].append(index)
        for length, indices in by_length.items():
            self._read_alike(length, datas, indices, result)
        return result

    def _read_alike(
        self,
        length: int,
        datas: Sequence[bytes],
        indices: list[int],
        result: list[Persons | InputError],
    ) -> None:
        """Read messages of one length, form by form."""
        left = np.array(indices, np.intp)
        if not HEADER_SIZE < length <= MAX_MESSAGE:
            for index in indices:
                result[index] = InputError(
                    f"a {SKELETON_ARRAY} has {length} bytes: expected {HEADER_SIZE + 1} to "
                    f"{MAX_MESSAGE}"
                )
            return
        joined = b"".join([datas[i] for i in indices])
        rows = np.frombuffer(joined, np.uint8).reshape(-1, length).copy()
        known = list(self._forms[length])
        while len(left):
            try:
                form = known.pop() if known else self._new_form(datas[left[0]])
            except InputError as error:
                result[left[0]] = error
                left, rows = left[1:], rows[1:]
                continue
            fits = np.empty(len(rows), np.bool_)
            is_last = _have_form(rows, form.fixed, form.texts, fits) == len(rows)
            fitting, where = (rows, left) if is_last else (rows[fits], left[fits])
            persons_of_all, is_placed = _persons(form, fitting, self._sensor)
            self.fault = form.fault or ("" if is_placed else NO_POSITION)
            if self.fault:
                self.faults[self.fault] += len(where)
            for index, persons in zip(where.tolist(), persons_of_all, strict=True):
                result[index] = persons
            if is_last:
                return
            left, rows = left[~fits], rows[~fits]

    def _new_form(self, data: bytes) -> _Form:
        form = _form_of(data, self._sensor)
        size = form.fixed.nbytes + form.texts.nbytes
        if self._form_bytes + size > FORM_BYTES_KEPT:
            self._forms.clear()
            self._form_bytes = 0
        self._form_bytes += size
        forms = self._forms[len(data)]
        forms.append(form)
        del forms[:-FORMS_KEPT]
        return form


def _form_of(data: bytes, sensor: str) -> _Form:
    walker = Walker(data)
    walker.skip(4, 2)
    frame = walker.string()
    seen: set[str] = set()
    persons = tuple(_person(walker, seen) for _ in range(walker.length()))
    fault = names_fault(frame, seen, sensor)
    fixed = HEADER_SIZE + np.flatnonzero(walker.fixed)
    texts = np.frombuffer(data, np.uint8)[fixed]
    return _Form(
        is_little=walker.order == "<", fixed=fixed, texts=texts, persons=persons, fault=fault
    )


def names_fault(frame: str, joints: Collection[str], sensor: str) -> str:
    """What is wrong with the names in a message; empty if nothing is.

    Joints may be missing, and others may be there; both together is a misspelling.

    Args:
        frame: The message's frame.
        joints: All names of joints in it.
        sensor: The sensor.
    """
    expected = sensor_frame(sensor)
    if frame not in ("", expected):
        return f"its frame_id is '{frame}', expected '{expected}': are its joints in that frame?"
    missing = [name for name in JOINTS if name not in joints]
    unknown = sorted(set(joints) - set(JOINTS))
    if missing and unknown:
        return f"it has joints {', '.join(unknown)}, lacks {', '.join(missing)}: see their names"
    return ""


def _person(walker: Walker, seen: set[str]) -> tuple[str, PersonPlaces]:
    stamp_at = walker.skip(4, 2)
    walker.string()
    person = walker.string()
    names = [walker.string() for _ in range(walker.length())]
    seen.update(names)
    positions = walker.length()
    positions_at = walker.skip(8, 3 * positions)
    states = walker.length()
    states_at = walker.skip(1, states)
    named, joints = mapped_joints(person, names, positions, states)
    places = PersonPlaces(
        stamp=HEADER_SIZE + stamp_at,
        positions=HEADER_SIZE + positions_at,
        states=HEADER_SIZE + states_at,
        length=len(names),
        named=named,
        joints=joints,
    )
    return person, places


def mapped_joints(
    person: str, names: Sequence[str], positions: int, states: int
) -> tuple[IntArray, IntArray]:
    """Indices of a skeleton's joints that are mapped, and of each among the 15, both (m,).

    Args:
        person: The skeleton's id.
        names: Its joints.
        positions: Number of its positions.
        states: Number of its tracking states.

    Raises:
        InputError: If it has not as many of each.
    """
    if not len(names) == positions == states:
        raise InputError(
            f"skeleton '{person}' has {len(names)} names, {positions} positions and "
            f"{states} tracking states: expected as many of each"
        )
    ours = {JOINT_INDEX[name]: index for index, name in enumerate(names) if name in JOINT_INDEX}
    return np.array(list(ours.values()), np.int64), np.array(list(ours), np.int64)


def unknown_state(person: str, state: int) -> InputError:
    """The error for a tracking state that is none of the three."""
    return InputError(
        f"skeleton '{person}' has the tracking state {state}: "
        "expected 0 (not tracked), 1 (inferred) or 2 (tracked)"
    )


def _persons(form: _Form, rows: ByteArray, sensor: str) -> tuple[list[Persons | InputError], bool]:
    """The persons of messages of one form; whether any joint has a position, if any is tracked."""
    result: list[Persons | InputError] = [[] for _ in rows]
    is_tracked = is_placed = False
    for person, places in form.persons:
        stamps_ns, positions, state, highest = read_joints(rows, places, form.is_little)
        is_tracked |= bool(highest.any())
        is_placed |= bool(state.any())
        numbers = zip(stamps_ns.tolist(), highest.tolist(), strict=True)
        for index, (stamp_ns, highest_state) in enumerate(numbers):
            before = result[index]
            if isinstance(before, InputError):
                continue
            if highest_state > BEST_STATE:
                result[index] = unknown_state(person, highest_state)
                continue
            before.append(
                SkeletonSample(
                    stamp_ns=stamp_ns,
                    sensor=sensor,
                    person=person,
                    positions=positions[index],
                    tracking_state=state[index],
                )
            )
    return result, is_placed or not is_tracked


def read_joints(
    rows: ByteArray, places: PersonPlaces, is_little: bool
) -> tuple[IntArray, FloatArray, ByteArray, ByteArray]:
    """One person's joints in messages of one form.

    Args:
        rows: The messages, shape (n, bytes).
        places: Offsets of the numbers.
        is_little: Whether the numbers are little-endian.

    Returns:
        Stamps, shape (n,) [ns], positions, shape (n, 15, 3) [m], and states, shape (n, 15), of the
        15 joints; and the highest state of any joint in the message, shape (n,).
    """
    count = len(rows)
    stamps_ns, highest = np.empty(count, np.int64), np.empty(count, np.uint8)
    positions = np.empty((count, len(JOINTS), 3))
    state = np.empty((count, len(JOINTS)), np.uint8)
    _read_person(rows, places, is_little, stamps_ns, positions, state, highest)
    return stamps_ns, positions, state, highest
