"""One Azure Kinect and a real IMU with a clock of its own (HPI-CH/sevivi); its place is unknown."""

import importlib.util
from pathlib import Path

import pytest

from pose_io.samples import read_samples

pytestmark = pytest.mark.data

EXAMPLE = Path(__file__).parents[3] / "examples" / "fuse_with_imus.py"


def example():
    spec = importlib.util.spec_from_file_location("fuse_with_imus", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("motion", "segment", "offset_s", "alone"),
    [
        ("walking", "right_shank", 4.14, 0.55),
        ("3d_hand_movement", "right_forearm", 4.88, 0.75),
    ],
)
def test_clock_and_alignment_are_found_and_the_fused_rates_are_the_gyroscopes(
    shared_data, motion, segment, offset_s, alone
):
    folder, files = shared_data / "azure_imu", example()
    recorded = read_samples(folder / f"{motion}_positions_3d.csv.gz")
    skeletons, sensors = list(recorded.samples), tuple(recorded.sensors)
    imu = list(files.imu_samples(segment, folder / f"{motion}_RF.csv.gz", skeletons[0].stamp_ns))
    pipeline, estimates = files.fused([*skeletons, *imu], sensors)

    assert pipeline.clocks["imus"].offset_ns * 1e-9 == pytest.approx(offset_s, abs=0.05)
    (use,) = pipeline.imu_uses
    assert use.is_aligned
    assert use.frames_used > 0.7 * use.frames

    assert files.rate_agreement(pipeline, estimates, imu)[0] > 0.85
    camera_alone = files.fused(skeletons, sensors)[1]
    assert files.rate_agreement(pipeline, camera_alone, imu)[0] < alone
