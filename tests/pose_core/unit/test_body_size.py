"""Sizes of people are compared by what their measurements are worth."""

from dataclasses import replace

import numpy as np
from walking_person import POSES, frames

from pose_core.joints import JOINT_INDEX
from pose_core.people.body_size import BodySize


def measured(scale=1.0, *, seed=0, wander=0.0):
    """A person's size over four seconds; one hip wanders by so much [m]."""
    size, rng = BodySize(), np.random.default_rng(seed)
    offset = np.zeros(3)
    for frame in frames(4.0, rate=30.0, seed=seed, poses=POSES):
        offset = 0.95 * offset + 0.3 * wander * rng.standard_normal(3)
        for sample in frame.samples.values():
            positions = sample.positions * scale
            positions[JOINT_INDEX["left_hip"]] += offset
            size.add(replace(sample, positions=positions))
    return size


def test_the_same_person_is_more_likely_than_one_10_percent_smaller():
    known = measured()

    assert measured(seed=1).log_likelihood_ratio(known) > 3.0
    assert measured(0.9, seed=2).log_likelihood_ratio(known) < -4.0


def test_a_noisy_joint_does_not_change_the_identity():
    known = measured()

    assert measured(seed=1, wander=0.14).log_likelihood_ratio(known) > 0.0
