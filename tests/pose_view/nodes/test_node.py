"""The viewer node: its subscriptions, and the commands of its buttons."""

import itertools

import pytest
import viser
from patience import PATIENCE_S
from rcl_interfaces.srv import SetParameters
from std_srvs.srv import Trigger
from viewed_bag import moving_joints, skeleton_message
from websockets.sync.client import connect

from pose_node.conversions import to_header
from pose_view.nodes.viewer import ViewerNode


@pytest.fixture
def viewer(ros_context):
    from rclpy.parameter import Parameter

    return ros_context.add(ViewerNode(parameter_overrides=[Parameter("port", value=0)]))


def test_in_a_namespace_it_shows_its_own_graph_alone(ros_context, spin_until, monkeypatch):
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from pose_msgs.msg import Skeleton
    from rclpy.parameter import Parameter

    port = Parameter("port", value=0)
    viewer = ros_context.add(ViewerNode(namespace="/own", parameter_overrides=[port]))
    monkeypatch.setattr(type(viewer.viewer.server), "has_visitors", True)
    node = ros_context.make_node()
    for name in ("/own/humans/bodies/person_2", "/humans/bodies/person_3"):
        node.create_publisher(Skeleton, f"{name}/skeleton", 10)
    publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
    reports = [
        DiagnosticStatus(name="/own/fusion", message="tracking"),
        DiagnosticStatus(name="/other/fusion", message="waiting"),
    ]

    def complete():
        publisher.publish(DiagnosticArray(status=reports))
        return "person_2" in viewer._graph.bodies and "fusion" in viewer._graph._reports

    spin_until(complete)
    assert "/own/humans/bodies/person_2/skeleton" in subscriptions(viewer)
    assert "person_3" not in viewer._graph.bodies
    assert viewer._graph._reports["fusion"].message == "tracking"


@pytest.fixture
def visitor(viewer, monkeypatch):
    """Somebody who looks, without a browser: what counts is that there is one."""
    monkeypatch.setattr(type(viewer.viewer.server), "has_visitors", True)


def subscriptions(viewer):
    return {s.topic_name for s in viewer.subscriptions}


def test_without_a_browser_it_subscribes_to_nothing(viewer, spin_until):
    seen = []
    viewer.create_timer(0.1, lambda: seen.append(subscriptions(viewer)))
    spin_until(lambda: len(seen) > 5)

    assert not any("/humans" in topic or "kinect" in topic for topics in seen for topic in topics)


def test_it_subscribes_only_while_a_browser_is_open(viewer, spin_until, monkeypatch):
    monkeypatch.setattr(type(viewer.viewer.server), "has_visitors", True)
    wanted = {
        "/humans/bodies/subject/skeleton",
        "/humans/bodies/subject_imu/estimate",
        "/kinect_left/skeletons",
        "/tf_static",
        "/diagnostics",
    }
    spin_until(lambda: wanted <= subscriptions(viewer))
    assert not any(topic.startswith("/imu_") for topic in subscriptions(viewer))

    monkeypatch.setattr(type(viewer.viewer.server), "has_visitors", False)
    spin_until(lambda: not wanted & subscriptions(viewer))


def publish_and_find(ros_context, viewer, body):
    """Publishes a body's next skeleton at each call, and returns its forearm in the scene."""
    from pose_msgs.msg import Skeleton

    topic = f"/humans/bodies/{body}/skeleton"
    node = ros_context.make_node()
    publisher = node.create_publisher(Skeleton, topic, 10)
    joints = moving_joints(3.0)
    count = itertools.count()

    def drawn():
        at = next(count)
        header = to_header(at * 33_000_000, "map")
        publisher.publish(skeleton_message(joints[at % len(joints)], header, ""))
        return viewer.viewer.server.scene.get_handle_by_name(f"/bodies/{body}/left_forearm")

    drawn.end = lambda: node.destroy_publisher(publisher)
    return drawn


def test_a_body_that_is_published_is_drawn(ros_context, viewer, visitor, spin_until):
    drawn = publish_and_find(ros_context, viewer, "subject")

    spin_until(drawn)
    before = tuple(drawn().position)
    spin_until(lambda: tuple(drawn().position) != before)


def test_people_who_appear_are_drawn_besides_the_requested_bodies(
    ros_context, viewer, visitor, spin_until
):
    spin_until(publish_and_find(ros_context, viewer, "person_2"))

    title = viewer.viewer.server.scene.get_handle_by_name("/bodies/person_2/title")
    assert title.text == "Person 2"
    assert "Person 2" in viewer.viewer.plots.legend.content


def test_people_who_are_published_no_longer_are_removed(ros_context, viewer, visitor, spin_until):
    publish = publish_and_find(ros_context, viewer, "person_2")
    spin_until(publish)

    publish.end()

    scene = viewer.viewer.server.scene
    spin_until(lambda: scene.get_handle_by_name("/bodies/person_2") is None)
    assert "Person 2" not in viewer.viewer.plots.legend.content
    assert not [s for s in viewer._looking if "person_2" in s.topic_name]


def test_buttons_call_the_services_of_the_graph(ros_context, viewer, spin_until):
    calls = []
    node = ros_context.make_node()

    def answer(name, request, response):
        calls.append(name)
        response.success = True
        return response

    for name in ("calibration/calibrate", "recorder/start", "recorder/stop"):
        node.create_service(Trigger, name, lambda q, r, name=name: answer(name, q, r))
    spin_until(lambda: all(c.service_is_ready() for c in viewer._triggers.values()))
    viewer.calibrate()
    viewer.record(True)
    viewer.record(False)

    spin_until(lambda: len(calls) == 3)
    assert calls == ["calibration/calibrate", "recorder/start", "recorder/stop"]


def test_choosing_a_person_sets_it_at_every_node_that_follows_one(ros_context, viewer, spin_until):
    chosen = {}
    node = ros_context.make_node()

    def on_set(name, request, response):
        from rcl_interfaces.msg import SetParametersResult

        chosen[name] = request.parameters[0].value.string_value
        response.results = [SetParametersResult(successful=True)]
        return response

    for name in ("fusion", "calibration"):
        node.create_service(
            SetParameters, f"{name}/set_parameters", lambda q, r, name=name: on_set(name, q, r)
        )
    ready = [viewer._setters[name] for name in ("fusion", "calibration")]
    spin_until(lambda: all(client.service_is_ready() for client in ready))
    viewer.choose_person("7")

    spin_until(lambda: len(chosen) == 2)
    assert chosen == {"fusion": "7", "calibration": "7"}
    spin_until(lambda: "following person 7" in viewer.viewer.graph._answer.content)


def test_a_missing_recorder_is_reported(viewer, spin_until):
    viewer.record(True)

    spin_until(lambda: "nobody offers recorder/start" in viewer.viewer.graph._answer.content)


def test_a_closed_browser_is_removed(viewer, spin_until):
    address = viewer.viewer.server.address.replace("http", "ws")
    with connect(address, subprotocols=[f"viser-v{viser.__version__}"], max_size=None) as browser:
        browser.recv(timeout=PATIENCE_S)
        server = viewer.viewer.server._websock_server
        assert len(server._live_connections) == 1
    spin_until(lambda: not server._live_connections)
