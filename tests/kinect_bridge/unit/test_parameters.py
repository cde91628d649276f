import pytest

from kinect_bridge.parameters import KinectBridgeParameters
from pose_core.errors import ParameterError
from pose_core.parameters import from_mapping


@pytest.mark.parametrize("name", ["", "left/right", "left eye", "_", "links-oben"])
def test_a_name_that_is_no_part_of_a_topic_is_refused(name):
    with pytest.raises(ParameterError, match="cannot be part of a ROS name"):
        from_mapping(KinectBridgeParameters, {"name": name})


def test_the_start_is_now_unless_given():
    assert KinectBridgeParameters().start_at_ns(17) == 17
    assert KinectBridgeParameters(start_at="1763697600000000000").start_at_ns(17) == (
        1_763_697_600_000_000_000
    )


@pytest.mark.parametrize("text", ["noon", "1.5", "-1", "1e18", "9999999999999999999"])
def test_a_start_that_is_not_a_unix_time_in_nanoseconds_is_refused(text):
    with pytest.raises(ParameterError, match="not a UNIX time in integer nanoseconds"):
        KinectBridgeParameters(start_at=text).start_at_ns(0)
