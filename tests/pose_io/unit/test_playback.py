"""Due messages in the playback of a bag."""

import pytest

from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.playback import PlaybackClock, Playlist

T0 = 1_000 * NS_PER_S


@pytest.fixture
def bag(tmp_path):
    """A latched message at 0 s, then one a second on /count; /other at 2.5 s."""
    with BagWriter(tmp_path / "bag") as writer:
        text = writer.typestore.types["std_msgs/msg/String"]
        writer.add_topic("/latched", "std_msgs/msg/String", latched=True)
        writer.write("/latched", text("model"), T0)
        for second in range(5):
            writer.write("/count", text(str(second)), T0 + second * NS_PER_S)
            if second == 2:
                writer.write("/other", text("x"), T0 + 2_500_000_000)
    with open_bag(tmp_path / "bag") as bag:
        yield bag


def seconds(messages):
    return [(message.topic, (message.stamp_ns - T0) / NS_PER_S) for message in messages]


def test_messages_are_due_in_order_and_once(bag):
    playlist = Playlist(bag)

    assert playlist.rewind() == []
    assert seconds(playlist.due(T0 + NS_PER_S)) == [("/latched", 0), ("/count", 0), ("/count", 1)]
    assert playlist.next_ns == T0 + 2 * NS_PER_S
    assert seconds(playlist.due(T0 + 10 * NS_PER_S)) == [
        ("/count", 2),
        ("/other", 2.5),
        ("/count", 3),
        ("/count", 4),
    ]
    assert playlist.next_ns is None


def test_after_a_start_offset_the_latched_past_comes_first(bag):
    playlist = Playlist(bag, start_offset_s=2.2)

    assert seconds(playlist.rewind()) == [("/latched", 0)]
    assert playlist.next_ns == T0 + 2_500_000_000


def test_only_chosen_topics_are_played(bag):
    playlist = Playlist(bag, ["/other"])
    playlist.rewind()

    assert seconds(playlist.due(T0 + 10 * NS_PER_S)) == [("/other", 2.5)]


def test_it_can_be_played_again(bag):
    playlist = Playlist(bag)
    playlist.rewind()
    first = list(playlist.due(T0 + 10 * NS_PER_S))
    playlist.rewind()

    assert list(playlist.due(T0 + 10 * NS_PER_S)) == first


def test_a_topic_that_is_not_there_is_refused(bag):
    with pytest.raises(InputError, match="holds no topic /nothing: it has /latched, /count"):
        Playlist(bag, ["/nothing"])


def test_a_start_after_the_end_is_refused(bag):
    with pytest.raises(InputError, match=r"start_offset = 4\.5 s is after the end"):
        Playlist(bag, start_offset_s=4.5)


@pytest.mark.parametrize("rate", [0.5, 1.0, 10.0])
def test_the_position_runs_at_the_rate(rate):
    clock = PlaybackClock(T0, rate, paused=False, now_ns=50)

    assert clock.position_ns(50 + 2 * NS_PER_S) == T0 + round(2 * NS_PER_S * rate)
    assert clock.wait_ns(T0 + NS_PER_S, 50) == round(NS_PER_S / rate)
    assert clock.wait_ns(T0 - NS_PER_S, 50) == 0


def test_a_pause_takes_no_time_of_the_recording():
    clock = PlaybackClock(T0, 2.0, paused=False, now_ns=0)
    clock.pause(NS_PER_S)
    paused_at = clock.position_ns(5 * NS_PER_S)
    clock.resume(9 * NS_PER_S)

    assert paused_at == T0 + 2 * NS_PER_S
    assert clock.position_ns(10 * NS_PER_S) == T0 + 4 * NS_PER_S


def test_pausing_and_resuming_twice_changes_nothing():
    clock = PlaybackClock(T0, 1.0, paused=True, now_ns=0)
    clock.pause(3)
    clock.resume(10)
    clock.resume(20)

    assert clock.position_ns(30) == T0 + 20


def test_a_jump_keeps_the_rate():
    clock = PlaybackClock(T0, 2.0, paused=False, now_ns=0)
    clock.jump(T0, 7 * NS_PER_S)

    assert clock.position_ns(8 * NS_PER_S) == T0 + 2 * NS_PER_S
