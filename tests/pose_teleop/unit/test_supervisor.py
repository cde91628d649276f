"""The states that a robot goes through."""

import pytest

from pose_teleop.parameters import ArmParameters
from pose_teleop.supervisor import LATCHED, ArmFault, State, Supervisor

STEP_NS = 10_000_000


class Story:
    """A supervisor, and what it is told."""

    def __init__(self, must_let_go=True):
        parameters = ArmParameters(
            settle_time=0.1,
            soft_velocity=0.5,
            soft_tolerance=0.1,
            ramp_time=1.0,
            dead_man="heartbeat" if must_let_go else "none",
        )
        self.supervisor = Supervisor(parameters, full_velocity=8.0)
        self.now_ns = 0

    def go(self, steps=1, fault=None, held=True, at_rest=False, distance=1.0):
        for _ in range(steps):
            self.now_ns += STEP_NS
            state = self.supervisor.update(
                now_ns=self.now_ns,
                fault=fault,
                is_held=held,
                is_at_rest=at_rest,
                distance=lambda: distance,
            )
        return state

    def follow(self):
        self.go(20)
        assert self.go(distance=0.05) is State.FOLLOWING
        return self


def test_it_waits_until_the_dead_man_input_is_held():
    story = Story()

    assert story.go(100, held=False) is State.WAITING
    assert story.supervisor.fault is ArmFault.NOT_HELD


def test_it_starts_softly_after_all_has_been_well_for_a_while():
    story = Story()

    assert story.go(10) is State.WAITING
    assert story.go(2) is State.SOFT_START
    assert story.supervisor.fault is None


def test_trouble_before_the_start_begins_the_wait_anew():
    story = Story()
    story.go(9)
    story.go(1, fault=ArmFault.STALE)

    assert story.go(9) is State.WAITING


def test_it_follows_once_it_is_at_the_persons_pose():
    story = Story()
    story.go(20)

    assert story.go(20, distance=0.2) is State.SOFT_START
    assert story.go(1, distance=0.05) is State.FOLLOWING


def test_the_velocity_begins_softly_and_ramps_up():
    story = Story().follow()
    first = story.supervisor.fastest
    story.go(50)
    halfway = story.supervisor.fastest
    story.go(60)

    assert (first, story.supervisor.fastest) == (0.5, 8.0)
    assert first < halfway < 8.0


def test_a_soft_start_that_does_not_catch_up_becomes_faster():
    story = Story()
    story.go(20)
    story.go(600)

    assert 0.5 < story.supervisor.fastest < 8.0


@pytest.mark.parametrize("fault", list(ArmFault))
def test_any_fault_slows_it_down_to_a_stop(fault):
    story = Story().follow()

    assert story.go(1, fault=fault) is State.SLOWING
    assert story.go(5, fault=fault) is State.SLOWING
    assert story.go(1, fault=fault, at_rest=True) is State.FROZEN
    assert story.go(100, fault=fault, at_rest=True) is State.FROZEN
    assert story.supervisor.fault is fault


def test_a_latched_fault_is_named_until_the_dead_man_input_is_released():
    story = Story().follow()
    story.go(1, fault=ArmFault.LAGS)
    story.go(5, fault=ArmFault.NO_ROBOT, at_rest=True)
    story.go(50, at_rest=True)
    assert story.supervisor.fault is story.supervisor.latched is ArmFault.LAGS

    story.go(1, held=False, at_rest=True)
    assert story.supervisor.latched is None
    assert story.supervisor.fault is ArmFault.NOT_HELD


def test_letting_go_of_the_dead_man_input_stops_it():
    story = Story().follow()

    assert story.go(1, held=False) is State.SLOWING
    assert story.supervisor.fault is ArmFault.NOT_HELD


def test_a_fault_that_is_over_does_not_stop_the_braking():
    story = Story().follow()
    story.go(1, fault=ArmFault.STALE)

    assert story.go(10) is State.SLOWING


def test_after_a_stop_it_starts_softly_again():
    story = Story().follow()
    story.go(1, fault=ArmFault.STALE)
    story.go(1, fault=ArmFault.STALE, at_rest=True)

    assert story.go(1, at_rest=True) is State.WAITING
    assert story.go(20, at_rest=True) is State.SOFT_START


@pytest.mark.parametrize("fault", sorted(LATCHED, key=lambda f: f.name))
def test_after_a_grave_fault_the_dead_man_input_must_be_let_go_first(fault):
    story = Story().follow()
    story.go(1, fault=fault)
    story.go(1, fault=fault, at_rest=True)

    assert story.go(200, at_rest=True) is State.FROZEN
    story.go(1, held=False, at_rest=True)
    assert story.go(20, at_rest=True) is State.SOFT_START


def test_without_a_dead_man_input_a_latched_fault_needs_no_release():
    story = Story(must_let_go=False).follow()
    story.go(1, fault=ArmFault.PERSON_CHANGED)
    story.go(1, fault=ArmFault.PERSON_CHANGED, at_rest=True)

    assert story.go(30, at_rest=True) is State.SOFT_START
