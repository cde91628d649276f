"""The vote on reference frames whose z axes point down."""

from pose_core.imu.z_down_vote import MIN_LEAD, imus_to_turn_over


def test_sound_imus_stay_as_they_are():
    assert (
        imus_to_turn_over({"torso": -30.0, "left_thigh": 23.0, "left_shank": -2.0}, set()) == set()
    )


def test_imus_of_one_kind_are_turned_over_together():
    leads = {"torso": 50.0, "left_thigh": 30.0, "left_shank": 1.0}
    assert imus_to_turn_over(leads, set()) == leads.keys()


def test_a_single_imu_needs_a_clear_lead_of_its_own():
    others = {"left_thigh": -20.0, "right_thigh": -20.0}
    assert imus_to_turn_over({"torso": MIN_LEAD + 1.0, **others}, set()) == {"torso"}
    assert imus_to_turn_over({"torso": MIN_LEAD - 1.0, **others}, set()) == set()


def test_imus_that_were_turned_over_vote_for_the_next_ones():
    assert imus_to_turn_over({"left_shank": 2.0}, {"torso", "left_thigh"}) == {"left_shank"}
