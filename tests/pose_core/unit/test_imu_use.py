"""What is said about the use of an IMU."""

from pose_core.imu.imu_use import ImuUse


def test_an_imu_that_was_used_until_it_was_contradicted_says_for_how_long():
    use = ImuUse(segment="left_forearm", frames=200, frames_used=190, contradictions=1)

    assert str(use).startswith("left_forearm: not used, the cameras or its gyroscope contradict it")
    assert str(use).endswith("; before, it was used for 95 % of frames")


def test_an_imu_in_use_says_since_when():
    use = ImuUse(
        segment="torso",
        has_moved=True,
        is_aligned=True,
        start_ns=10**18,
        alignments_ns=[10**18 + 3_500_000_000],
        frames=200,
        frames_used=180,
    )
    assert str(use).startswith("torso: used from 3.5 s on, for 90 % of frames, tilt known to")
    use.note_aligned(10**18 + 8 * 10**9)
    use.note_aligned(10**18 + 30 * 10**9)
    assert str(use).startswith("torso: used from 3.5 s on (aligned again at 8.0, 30.0 s), for 90 %")
    assert use.aligned_ns == 10**18 + 30 * 10**9


def test_an_imu_that_never_took_part_was_never_used():
    assert "used from" not in str(ImuUse(segment="torso", frames=200))
