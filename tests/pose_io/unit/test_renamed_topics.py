import argparse

import pytest

from pose_core.errors import InputError
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.renamed_topics import add_remap_argument
from pose_io.typestore import make_typestore


@pytest.fixture(params=["mcap", "sqlite3"])
def path(request, tmp_path):
    text = make_typestore().types["std_msgs/msg/String"]
    with BagWriter(tmp_path / "bag", storage=request.param) as writer:
        for stamp_ns, topic in enumerate(("/one", "/other", "/one")):
            writer.write(topic, text(data=topic), stamp_ns)
    return tmp_path / "bag"


def options(*words):
    parser = argparse.ArgumentParser()
    add_remap_argument(parser)
    return parser.parse_args(words).remap


def test_a_topic_is_read_under_its_new_name(path):
    with open_bag(path, options("--remap", "one:=/imu_left_thigh/data")) as bag:
        assert set(bag.topics) == {"/imu_left_thigh/data", "/other"}
        assert bag.topics["/imu_left_thigh/data"].count == 2
        messages = list(bag.messages(["/imu_left_thigh/data"]))
        assert [bag.deserialize(each).data for each in messages] == ["/one", "/one"]
        assert {each.topic for each in messages} == {"/imu_left_thigh/data"}
        assert not list(bag.messages(["/one"]))
        assert len(list(bag.messages())) == 3


def test_two_topics_change_their_names(path):
    with open_bag(path, options("--remap", "/one:=/other", "/other:=/one")) as bag:
        assert [each.topic for each in bag.messages()] == ["/other", "/one", "/other"]


def test_a_topic_that_the_bag_lacks_is_an_error_that_lists_the_topics(path):
    with pytest.raises(InputError, match="has no topic /ones; it has /one, /other"):
        open_bag(path, options("--remap", "/ones:=/two"))


def test_two_topics_of_one_name_are_an_error(path):
    with pytest.raises(InputError, match=r"2 topics of .* would be /other"):
        open_bag(path, options("--remap", "/one:=/other"))


@pytest.mark.parametrize("text", ["/one", ":=/two", "/one:=", ""])
def test_half_a_renaming_is_an_error(text, capsys):
    with pytest.raises(SystemExit):
        options("--remap", text)
    assert "expected OLD:=NEW, two names of topics" in capsys.readouterr().err


def test_a_topic_that_is_named_twice_is_an_error(path):
    with pytest.raises(InputError, match="/one is named twice, as /two and /three"):
        open_bag(path, options("--remap", "/one:=/two", "one:=three"))


def test_a_bag_whose_topics_have_no_slash_at_the_beginning(tmp_path):
    text = make_typestore().types["std_msgs/msg/String"]
    with BagWriter(tmp_path / "bag") as writer:
        writer.write("one", text(data=""), 0)
    with open_bag(tmp_path / "bag", options("--remap", "one:=/two")) as bag:
        assert set(bag.topics) == {"/two"}
