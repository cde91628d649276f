"""Variants for the suite on captured motion: sets of IMUs, and ablations of the filter."""

from dataclasses import replace

from pose_bench.captured import CapturedMethod
from pose_core.filter.tuning import CameraNoise, FilterTuning
from pose_core.joints import SEGMENTS
from pose_sim.captured.imus import NINE

FIVE = ("pelvis", "left_forearm", "right_forearm", "left_shank", "right_shank")
ELEVEN = (*NINE, "pelvis", "head")
IMU_SETS: dict[str, tuple[str, ...]] = {
    "1: trunk": ("torso",),
    "2: one arm": ("right_upper_arm", "right_forearm"),
    "2: shanks": ("left_shank", "right_shank"),
    "3: trunk, shanks": ("torso", "left_shank", "right_shank"),
    "5: pelvis, forearms, shanks": FIVE,
    "9: trunk, limbs": NINE,
    "11: and pelvis, head": ELEVEN,
    "13: and feet": (*ELEVEN, "left_foot", "right_foot"),
    "15: and hands": SEGMENTS,
}
"""Segments with an IMU; 15 are all segments."""


def imu_set_methods() -> tuple[CapturedMethod, ...]:
    """The default estimator with every set of IMUs, first without IMUs."""
    sets = (
        CapturedMethod(name=name, use_imus=True, segments=segments)
        for name, segments in IMU_SETS.items()
    )
    return CapturedMethod(name="none"), *sets


def ablation_methods() -> tuple[CapturedMethod, ...]:
    """The default estimator without IMUs, complete and with one part removed; and with IMUs."""
    methods = [CapturedMethod(name="default")]
    for name, tuning in _ablations().items():
        methods.append(CapturedMethod(name=f"without {name}", tuning=tuning))
    methods.append(CapturedMethod(name="default+imus", use_imus=True))
    for name, camera in (
        ("delays", CameraNoise(delay_prior=1e12)),
        ("shared offsets", CameraNoise(shared_offset_stddev=0.0)),
    ):
        tuning = replace(FilterTuning(), camera=camera)
        methods.append(CapturedMethod(name=f"+imus, without {name}", use_imus=True, tuning=tuning))
    return tuple(methods)


def _ablations() -> dict[str, FilterTuning]:
    """Tunings of the filter with one part removed, by its name."""
    whole = FilterTuning()
    camera, motion, posture = whole.camera, whole.motion, whole.posture
    uncarried = replace(motion, carried=dict.fromkeys(motion.carried, 0.0))
    free = replace(
        posture,
        hinge_stddev=30.0,
        twist_stddev=dict.fromkeys(posture.twist_stddev, 30.0),
        waist_stddev=(30.0, 30.0, 30.0),
    )
    return {
        "offsets of views": replace(whole, camera=replace(camera, offset_stddev=1e-4)),
        "the body's own occlusion": replace(whole, camera=replace(camera, occluded_stddev=0.0)),
        "heavy tails": replace(whole, camera=replace(camera, student_dof=1e6)),
        "carried accelerations": replace(whole, motion=uncarried),
        "posture": replace(whole, posture=free),
    }
