"""The bytes that ``fuse`` writes are those of the messages that the node publishes."""

import numpy as np
import pytest
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_fusion.conversions import to_bag_message, to_messages
from pose_fusion.estimate_bytes import EstimateBytes
from pose_io.cdr.message_template import MessageTemplate
from pose_io.typestore import make_typestore


@pytest.mark.parametrize("estimator", ["default", "left"])
def test_serialised_estimates_equal_the_messages(estimator):
    _, dof = motion(3.0)
    samples = skeleton_samples(
        kinematics().pose(dof).positions, extrinsics(), np.random.default_rng(2), 0.005
    )
    pipeline = Pipeline(PipelineParameters(estimator=estimator), extrinsics())
    blocks = []
    pipeline.outlet = blocks.append
    for sample in samples:
        pipeline.add(sample)
    typestore = make_typestore()
    fast = EstimateBytes(pipeline.model, "someone", typestore, blocks[0][0])
    for block in (blocks[0], blocks[-1]):
        block.tracking_state[:, :3] = 0, 1, 2
        found = dict(fast.write(block, np.full(len(block), 0.25)))
        messages = to_messages(block[0], pipeline.model, "someone", 0.25)
        assert found.keys() == messages.keys()
        for topic, message in messages.items():
            expected = to_bag_message(message, typestore)
            data = typestore.serialize_cdr(expected, expected.__msgtype__)
            assert found[topic][0].tobytes() == bytes(data), topic


def test_a_template_returns_its_numbers():
    typestore = make_typestore()
    point = typestore.types["geometry_msgs/msg/Point"](x=1.0, y=2.0, z=3.0)
    np.testing.assert_array_equal(MessageTemplate(point, typestore).float64, [1.0, 2.0, 3.0])


@pytest.mark.parametrize("count", [2, 4])
def test_a_template_refuses_a_wrong_count_of_numbers(count):
    typestore = make_typestore()
    point = typestore.types["geometry_msgs/msg/Point"](x=1.0, y=2.0, z=3.0)
    with pytest.raises(ValueError, match="expected"):
        MessageTemplate(point, typestore).fill(np.zeros(1, np.int64), np.zeros((1, count)))
