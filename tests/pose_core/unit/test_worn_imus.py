"""Each IMU has the link of the segment on which it is worn, its own or an exchanged one."""

from pose_core.body.model import load_body_model
from pose_core.filter.worn_imus import WornImus

SEGMENTS = ("left_thigh", "right_thigh", "tail")
MODEL = load_body_model("default")


def links_of(imus):
    return {imu.use.segment: MODEL.link_names[imu.link] for _, imu in imus.with_link(SEGMENTS)}


def make():
    imus = WornImus(MODEL, {})
    imus.with_link(SEGMENTS)
    return imus


def test_exchanged_imus_have_each_others_link_and_get_their_own_back():
    imus = make()
    own = links_of(imus)
    assert set(own) == {"left_thigh", "right_thigh"}
    imus.wear("left_thigh", "right_thigh")
    imus.wear("right_thigh", "left_thigh")
    assert links_of(imus) == {"left_thigh": own["right_thigh"], "right_thigh": own["left_thigh"]}
    assert imus.carriers(SEGMENTS) == ("right_thigh", "left_thigh", "tail")
    imus.wear("left_thigh", "left_thigh")
    assert links_of(imus)["left_thigh"] == own["left_thigh"]


def test_an_imu_on_a_segment_without_a_link_is_not_used_but_the_other_one_is():
    imus = make()
    own = links_of(imus)
    imus.wear("left_thigh", "tail")
    imus.wear("tail", "left_thigh")
    assert links_of(imus) == {"right_thigh": own["right_thigh"], "tail": own["left_thigh"]}
