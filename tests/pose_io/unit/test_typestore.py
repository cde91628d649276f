"""Message types of packages that are installed with ROS."""

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.typestore import make_typestore, require_type

FILES = {
    "outer_msgs": ("Outer", "std_msgs/Header header\ninner_msgs/Inner[] parts"),
    "inner_msgs": ("Inner", "float64[3] values\nstring name"),
    "open_msgs": ("Open", "missing_msgs/Missing[2] parts"),
}


@pytest.fixture(autouse=True)
def installed(tmp_path, monkeypatch):
    for package, (name, text) in FILES.items():
        folder = tmp_path / "ros" / "share" / package / "msg"
        folder.mkdir(parents=True)
        (folder / f"{name}.msg").write_text(text)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path / 'empty'}:{tmp_path / 'ros'}")


def test_a_type_that_consists_of_another_packages_types_is_written_and_read(tmp_path):
    store = make_typestore()
    require_type(store, "outer_msgs/msg/Outer")
    inner = store.types["inner_msgs/msg/Inner"](values=np.arange(3.0), name="a")
    stamp = store.types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = store.types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    with BagWriter(tmp_path / "bag", typestore=store) as bag:
        bag.write("/outer", store.types["outer_msgs/msg/Outer"](header=header, parts=[inner]), 1)
    with open_bag(tmp_path / "bag") as bag:
        (message,) = bag.messages(["/outer"])
        assert bag.deserialize(message).parts[0].name == "a"


@pytest.mark.parametrize(
    ("msgtype", "said"),
    [
        ("open_msgs/msg/Open", "package 'missing_msgs' is not installed"),
        ("inner_msgs/msg/Other", "does not define the message type 'inner_msgs/msg/Other'"),
    ],
)
def test_a_type_without_a_definition_is_refused(msgtype, said):
    with pytest.raises(InputError, match=said):
        require_type(make_typestore(), msgtype)
