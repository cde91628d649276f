import numpy as np
import pytest

from pose_core.errors import InputError
from pose_io.recordings.recording import make_recording, make_stream


def stream(name="left", host=(0, 10, 20), sensor=None, person=None):
    count = len(host)
    rng = np.random.default_rng(1)
    return make_stream(
        name,
        host_time_ns=host,
        sensor_time_ns=sensor,
        person=person or ["anna"] * count,
        positions=rng.normal(size=(count, 15, 3)),
        tracking_state=np.full((count, 15), 2, dtype=np.uint8),
    )


def test_rows_with_the_same_stamp_are_one_frame():
    seen = stream(host=(0, 0, 10), person=["anna", "ben", "anna"])

    assert len(seen) == 2
    assert [seen.person[row] for row in seen.rows(0)] == ["anna", "ben"]
    assert [seen.person[row] for row in seen.rows(1)] == ["anna"]
    assert seen.persons == ("anna", "ben")


def test_rows_of_a_frame_need_not_stand_together():
    seen = stream(host=(0, 10, 0, 10), person=["anna", "anna", "ben", "ben"])

    assert seen.host_time_ns.tolist() == [0, 10]
    assert [seen.person[row] for row in seen.rows(1)] == ["anna", "ben"]


def test_a_person_twice_in_a_frame_is_counted_and_the_first_kept():
    seen = stream(host=(0, 0, 10))

    assert seen.rows_repeated == 1
    assert seen.person == ("anna", "anna")


def test_a_frame_without_persons_stays_a_frame():
    seen = stream(person=["anna", "", "anna"])

    assert len(seen) == 3
    assert list(seen.rows(1)) == []
    assert len(seen.positions) == 2


def test_time_zero_is_the_earliest_host_time_of_all_sensors():
    recording = make_recording("file", "csv", [stream(host=(7, 8)), stream("right", host=(5, 9))])

    assert recording.time_zero_ns == 5


def test_a_sensor_is_found_by_name_and_by_index():
    recording = make_recording("file", "csv", [stream("left"), stream("right")])

    assert recording.stream("right") is recording.streams[1]
    assert recording.stream("1") is recording.streams[1]


def test_a_name_goes_before_an_index():
    recording = make_recording("file", "csv", [stream("1"), stream("0")])

    assert recording.stream("1") is recording.streams[0]


def test_a_missing_second_camera_is_refused_with_what_there_is():
    recording = make_recording("one.csv", "csv", [stream("138.251.213.82")])

    with pytest.raises(InputError) as error:
        recording.stream("1")

    assert str(error.value).startswith(
        "recording has 1 sensor (138.251.213.82), sensor '1' was asked for: "
    )
    assert "one.csv" in str(error.value)


def test_a_recording_without_frames_is_refused():
    with pytest.raises(InputError, match="holds no frames"):
        make_recording("empty.csv", "csv", [])
