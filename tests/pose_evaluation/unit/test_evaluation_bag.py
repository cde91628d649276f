import numpy as np
import pytest
from moving_body import motion

from pose_core.errors import InputError
from pose_evaluation.methods import methods_of_bag
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.message_maker import MessageMaker
from pose_io.typestore import make_typestore

MAKE = MessageMaker(make_typestore())
T_MAP_SENSOR = np.eye(4)
T_MAP_SENSOR[2, 3] = 1.0  # [m]


def skeletons(series):
    for stamp_ns, positions, state in zip(
        series.stamps_ns.tolist(), series.positions, series.tracking_state, strict=True
    ):
        yield stamp_ns, MAKE.skeleton(MAKE.header(stamp_ns, "map"), "1", positions, state)


@pytest.fixture
def make_bag(tmp_path):
    def make(sensors=("left", "right"), placed=("left", "right"), fused=True):
        path = tmp_path / "bag"
        with BagWriter(path) as bag:
            if placed:
                transforms = MAKE.sensor_transforms(dict.fromkeys(placed, T_MAP_SENSOR), 0)
                bag.write("/tf_static", transforms, 0)
            for index, name in enumerate(sensors):
                series = motion(rate=30.0, duration_s=2.0, begin_s=0.01 * index)
                for stamp_ns, skeleton in skeletons(series):
                    seen = MAKE.skeletons(skeleton.header, [skeleton])
                    bag.write(f"/kinect_{name}/skeletons", seen, stamp_ns)
            for stamp_ns, skeleton in skeletons(motion(rate=30.0, duration_s=2.0)) if fused else ():
                bag.write("/humans/bodies/subject/skeleton", skeleton, stamp_ns)
        return path

    return make


def methods(path):
    with open_bag(path) as bag:
        return methods_of_bag(bag)


def test_a_bag_s_methods_are_its_sensors_their_mean_and_the_fused_result(make_bag):
    assert list(methods(make_bag())) == ["left", "right", "mean", "fused"]


def test_raw_views_stay_in_their_sensor_s_frame_and_the_mean_is_in_map(make_bag):
    found = methods(make_bag())
    expected = motion(rate=30.0, duration_s=2.0)
    np.testing.assert_allclose(found["left"].positions, expected.positions)
    above = found["mean"].positions[5, 0] - expected.at(found["mean"].stamps_ns)[5, 0]
    np.testing.assert_allclose(above, [0.0, 0.0, 1.0], atol=0.01)


def test_without_all_extrinsics_there_is_no_mean(make_bag):
    assert list(methods(make_bag(placed=("left",)))) == ["left", "right", "fused"]


def test_one_sensor_has_no_mean(make_bag):
    assert list(methods(make_bag(sensors=("left",)))) == ["left", "fused"]


def test_a_bag_that_was_not_fused_has_its_raw_methods(make_bag):
    assert list(methods(make_bag(fused=False))) == ["left", "right", "mean"]


def test_a_bag_without_anybody_is_refused(make_bag):
    path = make_bag(sensors=(), fused=False)
    with pytest.raises(InputError, match="holds no skeletons"):
        methods(path)
