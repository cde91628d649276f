"""A pose for each of several people (walking people, drawn)."""

from dataclasses import replace

import numpy as np
import pytest
from crowd_of_people import frames_of, walker
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples
from walking_person import POSES

from pose_core.errors import ParameterError
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.people.pipeline import PeoplePipeline
from pose_core.session.extrinsics import extrinsics_from_map
from pose_core.stamps import NS_PER_S
from pose_core.streams.repeated_frames import FROZEN_FRAMES
from pose_core.streams.samples import ImuSample

PLACED = extrinsics_from_map(POSES)
TWO = [
    walker((2.5, -1.2), (0.0, 0.5)),
    walker((3.0, 1.2), (0.0, -0.5), scale=0.85, phase=1.5),
]


def fused(frames, **values):
    """The estimates by id, and the chain."""
    blocks = {}
    parameters = PipelineParameters(output_rate=0.0, **values)
    pipeline = PeoplePipeline(
        parameters, lambda body_id, block: blocks.setdefault(body_id, []).append(block), PLACED
    )
    for persons, _ in frames:
        pipeline.add(persons)
    pipeline.flush()
    return blocks, pipeline


@pytest.fixture(scope="module")
def two():
    return frames_of(TWO, 5.0)


def thigh_m(pipeline, body_id):
    return pipeline.shape_of(body_id).bone_lengths()["left_knee"]


def test_a_subject_with_an_id_of_other_people_is_refused_only_among_them():
    alone = PipelineParameters(subject="person_2")
    assert PeoplePipeline(alone, lambda *_: None).people == ()
    with pytest.raises(ParameterError, match=r"person_2.*choose another name"):
        PeoplePipeline(replace(alone, max_people=2), lambda *_: None)


def test_estimates_of_one_person_equal_those_of_the_single_pipeline():
    _, dof = motion(4.0)
    rng = np.random.default_rng(7)
    samples = skeleton_samples(kinematics().pose(dof).positions, extrinsics(), rng, 0.005)
    parameters = PipelineParameters(output_rate=0.0)
    single = Pipeline(parameters, extrinsics())
    expected = [e for sample in samples for e in single.add(sample)] + single.flush()
    blocks = []
    people = PeoplePipeline(parameters, lambda _, block: blocks.append(block), extrinsics())
    for sample in samples:
        people.add([sample])
    people.flush()
    estimates = [estimate for block in blocks for estimate in block]
    assert len(estimates) == len(expected) > 0
    np.testing.assert_array_equal(estimates[-1].position, expected[-1].position)


def test_every_tracked_person_has_an_id_and_own_bone_lengths(two):
    blocks, pipeline = fused(two, max_people=6)
    assert set(blocks) == {"subject", "person_2"}
    assert pipeline.people == ("subject", "person_2")
    lengths = sorted(thigh_m(pipeline, body_id) for body_id in blocks)
    assert lengths[0] == pytest.approx(0.85 * lengths[1], rel=0.05)


def test_a_person_who_left_is_identified_on_return():
    def there(_, index, time_s):
        return index == 0 or time_s < 3.0

    people = [walker((2.5, 0.0), (0.0, 0.0)), walker((2.5, 1.5), (0.0, 0.0), scale=0.85)]
    _, pipeline = fused(frames_of(people, 5.0, there=there), max_people=6)
    assert len(pipeline.people) == 1
    assert pipeline.remembered == {"subject", "person_2"}


@pytest.mark.parametrize(("scale", "is_doubted"), [(1.0, False), (0.87, True)])
def test_somebody_a_little_smaller_who_comes_instead_is_doubted(scale, is_doubted):
    def there(_, index, time_s):
        return time_s < 3.0 if index == 0 else time_s > 4.0

    people = [walker((2.5, 0.0), (0.0, 0.0)), walker((2.5, 0.0), (0.0, 0.0), scale=scale)]
    _, pipeline = fused(frames_of(people, 8.0, there=there))
    assert pipeline.people == ("subject",)
    assert pipeline.is_doubted == is_doubted


@pytest.mark.parametrize("is_live", [False, True])
def test_imus_while_a_returning_person_is_held_back_make_no_frame_late(is_live):
    def there(_, index, time_s):
        return time_s < 3.0 or (index == 1 and time_s > 5.0)

    people = [walker((2.5, 0.0), (0.0, 0.0)), walker((2.5, 1.5), (0.0, 0.0), scale=0.85)]
    parameters = PipelineParameters(output_rate=0.0)
    pipeline = PeoplePipeline(parameters, lambda *_: None, PLACED, is_live=is_live)
    frames = {persons[0].stamp_ns: persons for persons, _ in frames_of(people, 14.0, there=there)}
    imus_ns = range(min(frames), max(frames), NS_PER_S // 50)
    for stamp_ns in sorted({*frames, *imus_ns}):
        pipeline.add(frames[stamp_ns] if stamp_ns in frames else imu_at(stamp_ns))
    pipeline.flush()
    counts, starts = pipeline.people_counts, pipeline.subject.counters
    assert counts["returned"] == 1
    assert starts["frames_of_imus_alone"] > 10
    if is_live:
        assert counts["skeletons_held_too_long"] > 5
    else:
        assert starts["frames_too_late"] == 0
    assert starts["filter_restarts_gap"] <= 1  # that of the absence


def test_imus_while_a_person_who_jumped_is_held_back_make_no_frame_late():
    """Until it is certain that it is the same person, the one before the jump is still known."""
    pipeline = PeoplePipeline(PipelineParameters(output_rate=0.0), lambda *_: None, PLACED)
    shown = frames_of(TWO[:1], 8.0, ids=lambda *seen: "1" if seen[-1] < 5.0 else "2")
    frames = {persons[0].stamp_ns: persons for persons, _ in shown}
    jump_ns = min(frames) + 5 * NS_PER_S
    imus_ns = range(min(frames), max(frames), NS_PER_S // 50)
    for stamp_ns in sorted({*frames, *imus_ns}):
        frame = frames.get(stamp_ns)
        if frame is not None and stamp_ns > jump_ns:
            frame = [replace(each, positions=each.positions + [0.8, 0.0, 0.0]) for each in frame]
        pipeline.add(frame or imu_at(stamp_ns))
    pipeline.flush()
    assert pipeline.people_counts["returned"] == 1
    assert pipeline.subject.counters["frames_too_late"] == 0


def imu_at(stamp_ns):
    return ImuSample(
        stamp_ns=stamp_ns,
        segment="torso",
        orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        orientation_stddev=np.full(3, 0.01),
        angular_velocity=np.zeros(3),
    )


def test_skeletons_of_other_people_are_counted(two):
    blocks, pipeline = fused(two)
    assert set(blocks) == {"subject"}
    assert pipeline.others == 1
    assert pipeline.people_counts["skeletons_of_others"] > 200


def test_a_second_person_gets_own_bone_lengths():
    def there(_, index, time_s):
        return time_s < 4.0 if index == 0 else time_s > 5.0

    people = [walker((2.5, 0.0), (0.0, 0.0)), walker((2.5, 0.0), (0.0, 0.0), scale=0.8)]
    before, _ = fused(frames_of(people[:1], 4.0))
    blocks, pipeline = fused(frames_of(people, 17.0, there=there))
    assert pipeline.people_counts["subject_changed"] == 1
    assert thigh_m(pipeline, "subject") == pytest.approx(0.8 * 0.43, rel=0.06)
    assert before
    assert blocks


def test_samples_before_the_extrinsics_are_buffered(two):
    blocks = {}
    parameters = PipelineParameters(output_rate=0.0, max_people=2)
    pipeline = PeoplePipeline(parameters, lambda i, block: blocks.setdefault(i, []).append(block))
    for persons, _ in two[:200]:
        pipeline.add(persons)
    assert not blocks
    pipeline.use_extrinsics(PLACED)
    for persons, _ in two[200:]:
        pipeline.add(persons)
    assert set(blocks) == {"subject", "person_2"}


def test_samples_too_old_for_the_buffer_are_counted(two):
    pipeline = PeoplePipeline(PipelineParameters(output_rate=0.0), lambda *_: None)
    first = two[0][0]
    pipeline.add(first)
    pipeline.add(imu_at(first[0].stamp_ns))
    later_ns = first[0].stamp_ns + 31 * NS_PER_S
    pipeline.add([replace(person, stamp_ns=later_ns) for person in first])
    counts = pipeline.people_counts
    assert counts["skeletons_discarded_before_extrinsics"] == len(first)
    assert counts["imu_samples_discarded_before_extrinsics"] == 1


def test_frames_that_a_camera_repeats_are_left_out_of_a_recording_and_counted():
    frames = [persons for persons, _ in frames_of(TWO[:1], 4.0)]
    of_left = [k for k, persons in enumerate(frames) if persons and persons[0].sensor == "left"]
    first, *others = of_left[60:90]
    for k in others:
        stamps = {"stamp_ns": frames[k][0].stamp_ns}
        frames[k] = [replace(person, **stamps) for person in frames[first]]

    _, pipeline = fused([(persons, None) for persons in frames])

    assert pipeline.repeated_frames == {"left": len(others) - FROZEN_FRAMES + 1}
