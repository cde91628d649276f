"""Vote on whether the z axes of IMUs' reference frames point down (NED) instead of up.

Each IMU that is not aligned compares both cases
(:meth:`pose_core.imu.sensor_alignment.SegmentAlignment.compare_z_down`). IMUs are mostly of one
kind, so their leads are added: all are turned over once the sum is clear, a single one only if its
own lead is.
"""

from collections.abc import Mapping, Set

MIN_LEAD = 60.0  # [-] in log-likelihood, of a single IMU; 23 was the largest of a sound one
MAX_VOTE = 20.0  # [-] of an IMU's lead, for or against, in the sum of all
MIN_VOTES = 40.0  # [-] sum from which on all are of one kind


def imus_to_turn_over(leads: Mapping[str, float], turned: Set[str]) -> frozenset[str]:
    """Segments whose IMU is to be turned over.

    Args:
        leads: Lead of the case that z points down in log-likelihood [-], of each other IMU; a whole
            vote against it of an aligned one.
        turned: Segments whose IMU has been turned over already; each is a whole vote.
    """
    votes = MAX_VOTE * len(turned)
    votes += sum(min(max(lead, -MAX_VOTE), MAX_VOTE) for lead in leads.values())
    if votes >= MIN_VOTES:
        return frozenset(leads)
    return frozenset(segment for segment, lead in leads.items() if lead > MIN_LEAD)
