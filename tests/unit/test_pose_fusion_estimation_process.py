"""The estimator in a process of its own says what it says in this one."""

from dataclasses import fields, replace

import numpy as np
import pytest
from synthetic_body import body_offsets, extrinsics
from worn_imus import merged, moving_wearer

from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.errors import ParameterError
from pose_core.estimators.registry import body_model_of
from pose_core.fusion.estimation import Estimation
from pose_core.fusion.observation_block import block_of_observations
from pose_core.fusion.observer import COUNTERS, Observer
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.tracking import tracking_counters
from pose_core.imu.readings import NO_READINGS
from pose_core.joints import JOINT_INDEX
from pose_fusion.estimation_process import AT_ONCE, EstimationProcess

LEFT_LEG = [JOINT_INDEX[name] for name in ("left_knee", "left_foot")]


@pytest.fixture(scope="module")
def samples():
    *_, skeletons, imus = moving_wearer(9.0)
    return merged(skeletons, imus)


def observed(samples, parameters):
    observer = Observer(body_model_of(parameters), parameters, Counters(*COUNTERS))
    observer.place_sensors(extrinsics())
    observations = [o for sample in samples for o in observer.add(sample)]
    return observations + list(observer.flush()), observer.newest_ns


def estimated(kind, parameters, observations, newest_ns):
    """All estimates, and the counts."""
    counters = Counters(*tracking_counters(parameters))
    estimation = kind(body_model_of(parameters), parameters, counters)
    blocks = [block for each in observations for block in estimation.take([each])]
    blocks += estimation.flush(newest_ns)
    if isinstance(estimation, EstimationProcess):
        estimation.close()
    return [estimate for block in blocks for estimate in block], counters.as_dict()


def assert_same(found, expected):
    assert len(found) == len(expected) > 0
    for one, other in zip(found, expected, strict=True):
        for field in fields(one):
            np.testing.assert_equal(getattr(one, field.name), getattr(other, field.name))


@pytest.mark.parametrize("estimator", ["default", "smoothed", "li2020"])
def test_estimates_and_counts_are_the_same_to_the_last_bit(estimator, samples):
    parameters = FusionParameters(estimator=estimator)
    observations, newest_ns = observed(samples, parameters)
    expected, counts = estimated(Estimation, parameters, observations, newest_ns)
    found, found_counts = estimated(EstimationProcess, parameters, observations, newest_ns)
    assert_same(found, expected)
    assert found_counts == counts
    assert counts["estimates"] == len(found)


def troubled(observations):
    """The same with all that stops a filter, in a stretch of its own each."""
    rng = np.random.default_rng(5)
    result = []
    for k, seen in enumerate(observations):
        positions, stamp_ns = seen.positions.copy(), seen.stamp_ns
        if 60 <= k < 220:
            if k < 70:
                seen = replace(seen, readings=NO_READINGS)
            else:
                continue  # longer than the filter goes on for
        elif 220 <= k < 230:
            seen = replace(seen, readings=NO_READINGS)
        elif 260 <= k < 300:
            positions += 3.0 * rng.normal(size=3)  # somebody who is everywhere
        elif 330 <= k < 360:
            positions[:, LEFT_LEG] += 0.7 * rng.normal(size=(len(LEFT_LEG), 3))
        elif 380 <= k < 420 and k % 5 == 0:
            stamp_ns -= 400_000_000 if k % 10 else 120_000_000
        if k >= 440:
            stamp_ns -= 4_000_000_000  # a recording that begins anew
        result.append(replace(seen, positions=positions, stamp_ns=stamp_ns))
    return result


@pytest.mark.parametrize("estimator", ["default", "smoothed"])
def test_a_filter_that_is_stopped_goes_on_alike_in_a_block_and_by_itself(estimator, samples):
    parameters = FusionParameters(estimator=estimator)
    observations, newest_ns = observed(samples, parameters)
    observations = troubled(observations)
    expected, counts = estimated(Estimation, parameters, observations, newest_ns)
    found, found_counts = estimated(EstimationProcess, parameters, observations, newest_ns)
    assert_same(found, expected)
    assert found_counts == counts
    for name in (
        "filter_restarts_gap",
        "filter_restarts_strayed",
        "frames_too_late",
        "frames_late_but_used",
        "limbs_reopened",
    ):
        assert counts[name] > 0, name


def test_arrays_whose_rows_lie_apart_are_told_alike(samples):
    parameters = FusionParameters()
    observations, newest_ns = observed(samples, parameters)
    apart = [replace(each, positions=np.asfortranarray(each.positions)) for each in observations]
    assert not apart[0].positions.flags.c_contiguous
    expected, _ = estimated(Estimation, parameters, observations, newest_ns)
    found, _ = estimated(Estimation, parameters, apart, newest_ns)
    assert_same(found, expected)


def test_another_body_begins_anew_where_it_comes(samples):
    parameters = FusionParameters()
    observations, newest_ns = observed(samples, parameters)
    other = BodyShape(offsets=1.1 * body_offsets())
    change = AT_ONCE + 17
    observations[change:] = [replace(each, shape=other) for each in observations[change:]]
    expected, counts = estimated(Estimation, parameters, observations, newest_ns)
    found, _ = estimated(EstimationProcess, parameters, observations, newest_ns)
    assert_same(found, expected)
    assert counts["filter_starts"] == 2


def test_a_block_gives_its_observations_back(samples):
    observations, _ = observed(samples, FusionParameters())
    chosen = observations[::20]
    assert len({len(each.readings) for each in chosen}) > 1
    block = block_of_observations(chosen)
    for one, other in zip(block.observations(chosen[0].shape), chosen, strict=True):
        assert one.shape is other.shape
        assert one.readings.segments == other.readings.segments
        for field in fields(one):
            if field.name not in ("shape", "readings"):
                found, expected = getattr(one, field.name), getattr(other, field.name)
                np.testing.assert_array_equal(found, expected)
        for name in ("R_map_segment", "angular_velocity", "stddev", "age_s"):
            found, expected = getattr(one.readings, name), getattr(other.readings, name)
            np.testing.assert_array_equal(found, expected)


def test_parameters_that_cannot_work_are_refused_before_anything_is_started():
    parameters = FusionParameters(estimator="left", sensors=("one", "other"))
    with pytest.raises(ParameterError):
        EstimationProcess(body_model_of(parameters), parameters, Counters())
