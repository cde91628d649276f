"""Values whose arrays pass through shared memory."""

from dataclasses import dataclass

import numpy as np
import pytest

from pose_fusion.shared_slots import SharedSlots


@dataclass(frozen=True)
class Value:
    name: str
    floats: np.ndarray
    bytes_: np.ndarray
    empty: np.ndarray


def value(rows):
    return Value(
        "some",
        np.arange(3.0 * rows).reshape(rows, 3),
        np.arange(rows, dtype=np.uint8),
        np.empty((0, 3, 3)),
    )


@pytest.mark.parametrize("size", [2**16, 100])
def test_a_value_comes_back_whether_it_fits_or_not(size):
    slots = SharedSlots(2, size)
    sent = value(100)
    parcel = slots.pack(5, sent)
    found = slots.unpack(5, parcel)
    assert found.name == "some"
    for name in ("floats", "bytes_", "empty"):
        array, expected = getattr(found, name), getattr(sent, name)
        assert array.dtype == expected.dtype
        np.testing.assert_array_equal(array, expected)
        assert array.flags.carray  # contiguous, aligned, writeable: as kernels want it
    assert bool(parcel.sizes) == (size > 100)


def test_what_was_unpacked_stays_when_its_slot_is_used_again():
    slots = SharedSlots(2, 2**16)
    found = slots.unpack(0, slots.pack(0, value(10)))
    slots.pack(2, np.zeros(1000))
    np.testing.assert_array_equal(found.floats, value(10).floats)


def test_values_in_different_slots_do_not_touch():
    slots = SharedSlots(2, 2**12)
    parcels = [slots.pack(number, np.full(500, number)) for number in (6, 7)]
    for number, parcel in zip((6, 7), parcels, strict=True):
        np.testing.assert_array_equal(slots.unpack(number, parcel), np.full(500, number))


def test_a_small_pickle_is_all_that_is_sent_of_large_arrays():
    parcel = SharedSlots(1, 2**20).pack(0, value(10_000))
    assert len(parcel.data) < 1000
