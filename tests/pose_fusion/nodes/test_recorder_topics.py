"""Topics that nobody can have."""

import pytest
from rclpy.parameter import Parameter

from pose_core.errors import ParameterError
from pose_fusion.nodes.recorder import Recorder


@pytest.mark.parametrize("topic", ["a b", "/x//y", "1st", ""])
def test_an_invalid_topic_name_stops_the_recorder(ros_context, tmp_path, topic):
    values = {"output": str(tmp_path / "bag"), "topics": [topic]}
    with pytest.raises(ParameterError, match=f"topics: '{topic}' cannot be recorded") as caught:
        Recorder(parameter_overrides=[Parameter(k, value=v) for k, v in values.items()])
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []
