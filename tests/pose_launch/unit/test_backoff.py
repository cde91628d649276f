"""Delays of the launcher before it restarts a process."""

from pose_launch.supervising import MAX_DELAY_S, RECOVERED_S, BackOff


def test_quick_deaths_are_answered_ever_more_slowly():
    back_off = BackOff(0.5)

    delays = [back_off.delay_s(lived_s=1.0) for _ in range(8)]

    assert delays[:4] == [0.5, 1.0, 2.0, 4.0]
    assert delays[-1] == MAX_DELAY_S


def test_a_long_life_is_answered_at_once_again():
    back_off = BackOff(0.5)
    for _ in range(5):
        back_off.delay_s(lived_s=1.0)

    assert back_off.delay_s(lived_s=RECOVERED_S) == 0.5
    assert back_off.delay_s(lived_s=1.0) == 1.0


def test_no_delay_stays_no_delay():
    back_off = BackOff(0.0)

    assert [back_off.delay_s(lived_s=0.0) for _ in range(3)] == [0.0, 0.0, 0.0]
