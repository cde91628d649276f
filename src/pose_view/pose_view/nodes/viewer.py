"""The viewer node: subscriptions and service calls while a browser is connected."""

import queue
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from pose_msgs.msg import PoseEstimate, Skeleton, SkeletonArray
from rcl_interfaces.msg import Parameter as ParameterMessage, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from pose_core.stamps import NS_PER_S, serialized_ns
from pose_io.names import BODIES, skeletons_topic
from pose_io.topics import BODY_TOPIC
from pose_node.conversions import to_node_status
from pose_node.node_status import Level, Report
from pose_node.nodes.declaring import declare_parameters, overrides_of
from pose_node.nodes.diagnostics import DiagnosticsPublisher
from pose_node.nodes.qos import latched, sensor_data
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer
from pose_view.live import LiveGraph
from pose_view.nodes.newest import Newest, first_child
from pose_view.parameters import ViewParameters
from pose_view.plain_words import as_html
from pose_view.web.places import place_of
from pose_view.web.viewer import Viewer

IDLE_NS = 200_000_000  # [ns] between checks for browsers
STATUS_NS = 500_000_000  # [ns] between updates of the status lines
FOLLOWERS = ("fusion", "fusion_kinect", "fusion_imu", "calibration")
"""The nodes with the parameter ``person``."""
# Best effort, so that a slow viewer does not delay publishers; deep enough for bursts.
BODY_QOS = sensor_data(100)


class ViewerNode(Node):
    """Shows the graph on a web page; publishes only diagnostics.

    Args:
        **options: As for ``rclpy.node.Node``.

    Raises:
        PoseError: If the address or a parameter is invalid.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("viewer", **options)
        self._settings = parameters = declare_parameters(self, ViewParameters)
        self._prefix = self.get_namespace().rstrip("/") + "/"  # of this graph's topics and nodes
        self._tasks: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._looking: list[Subscription] = []
        self._shown_status_ns = 0
        self.viewer = Viewer(parameters, commands=self)
        self._graph = self._new_graph()
        self._newest = Newest()
        self._triggers = {
            name: self.create_client(Trigger, name)
            for name in ("calibration/calibrate", "recorder/start", "recorder/stop")
        }
        self._setters = {
            name: self.create_client(SetParameters, f"{name}/set_parameters") for name in FOLLOWERS
        }
        self._diagnostics = DiagnosticsPublisher(self, self._report)
        self._timer = steady_timer(self, IDLE_NS / NS_PER_S, self._step)
        server = self.viewer.server
        if server.opened:
            self.get_logger().warning(server.opened)
        self.get_logger().info(f"open {server.invitation} in a browser")

    # -- commands of the buttons; called in the page's threads ---------------------------------

    def calibrate(self) -> None:
        """Restart the calibration of the cameras."""
        self._tasks.put(partial(self._trigger, "calibration/calibrate"))

    def record(self, on: bool) -> None:
        """Start or stop recording."""
        self._tasks.put(partial(self._trigger, "recorder/start" if on else "recorder/stop"))

    def choose_person(self, person: str) -> None:
        """Select the person of this id."""
        self._tasks.put(partial(self._set_person, person))

    # -- the rest runs on the executor's thread -------------------------------------------------

    def _step(self) -> None:
        while not self._tasks.empty():
            self._tasks.get()()
        if not self.viewer.server.has_visitors:
            self._look_away()
            return
        if not self._looking:
            self._subscribe_all()
        self._newest.hand_over()
        now_ns = self._now_ns()
        now_s = now_ns / NS_PER_S
        graph = self._graph
        robot = graph.robot_tracks()
        self.viewer.show(graph.snapshot(now_ns), graph.track, now_s, now_s, robot)
        if now_ns - self._shown_status_ns > STATUS_NS:
            self._shown_status_ns = now_ns
            panel = self.viewer.graph
            assert panel is not None
            panel.show_status(as_html(self._graph.lines(now_ns)))
            panel.show_recording(self._graph.bag())
            panel.offer_persons(self._graph.persons())
            self._look_for_people()

    def _new_graph(self) -> LiveGraph:
        titles = {place.body: place.title for place in self.viewer.places}
        return LiveGraph(titles, self._settings.sensors, self._settings.plot_span)

    def _subscribe_all(self) -> None:
        """Subscribe to all topics."""
        self._graph, self._newest = self._new_graph(), Newest()
        for body in self._graph.bodies:
            self._subscribe_body(body)
        for sensor in self._settings.sensors:
            topic, take = skeletons_topic(sensor), partial(self._on_raw, sensor)
            self._subscribe(SkeletonArray, topic, take, qos_profile_sensor_data, raw=True)
        self._subscribe(TFMessage, "tf", self._on_tf, raw=True)
        self._subscribe(MarkerArray, "arm/markers", self._graph.add_robot, latched(1))
        histories = {"target": self._graph.robot_asked, "joint_states": self._graph.robot_joints}
        for name, history in histories.items():
            take = partial(self._newest.put, f"5 arm {name}", JointState, take=history.add)
            self._subscribe(JointState, f"arm/{name}", take, raw=True)
        self._subscribe(TFMessage, "tf_static", self._graph.add_static_tf, latched(50))
        self._subscribe(DiagnosticArray, "/diagnostics", self._on_diagnostics)
        self._pace(round(NS_PER_S / self._settings.rate))

    def _subscribe_body(self, body: str) -> None:
        prefix = f"humans/bodies/{body}"
        self._subscribe(Skeleton, f"{prefix}/skeleton", partial(self._on_skeleton, body), raw=True)
        on_estimate = partial(self._on_estimate, body)
        self._subscribe(PoseEstimate, f"{prefix}/estimate", on_estimate, raw=True)

    def _look_for_people(self) -> None:
        """Subscribe to published bodies that are not in the parameters."""
        asked_for = {place.body for place in self.viewer.places}
        for body in sorted(set(self._graph.bodies) - asked_for):
            if not self.count_publishers(f"humans/bodies/{body}/skeleton"):
                self._forget(body)
        names = (topic for topic, _ in self.get_topic_names_and_types())
        found = (BODY_TOPIC.match("/" + name.removeprefix(self._prefix)) for name in names)
        shown = {m["body"] for m in found if m and m["leaf"] in ("skeleton", "estimate")}
        for body in sorted(shown - set(self._graph.bodies)):
            self._graph.add_body(body, place_of(body).title)
            self._subscribe_body(body)

    def _forget(self, body: str) -> None:
        """Unsubscribe from a body that is no longer published."""
        self._graph.remove_body(body)
        theirs = [s for s in self._looking if f"{BODIES}{body}/" in s.topic_name]
        for subscription in theirs:
            self._looking.remove(subscription)
            self.destroy_subscription(subscription)

    def _look_away(self) -> None:
        """Unsubscribe from all topics when no browser is connected."""
        if self._looking:
            for subscription in self._looking:
                self.destroy_subscription(subscription)
            self._looking.clear()
            self._pace(IDLE_NS)

    def _pace(self, period_ns: int) -> None:
        self._timer.timer_period_ns = period_ns
        self._timer.reset()

    def _subscribe(
        self,
        kind: type,
        topic: str,
        callback: Callable[[Any], None],
        qos: Any = BODY_QOS,
        *,
        raw: bool = False,
    ) -> None:
        self._looking.append(self.create_subscription(kind, topic, callback, qos, raw=raw))

    def _on_estimate(self, body: str, data: bytes) -> None:
        take = partial(self._graph.add_estimate, body)
        self._newest.put(f"1 estimate {body}", PoseEstimate, data, take)

    def _on_tf(self, data: bytes) -> None:
        self._newest.put(f"2 tf {first_child(data)}", TFMessage, data, self._graph.add_tf)

    def _on_skeleton(self, body: str, data: bytes) -> None:
        self._graph.note_skeleton(body, serialized_ns(data), self._now_ns())
        take = partial(self._graph.add_skeleton, body)
        self._newest.put(f"3 skeleton {body}", Skeleton, data, take)

    def _on_raw(self, sensor: str, data: bytes) -> None:
        now_ns = self._now_ns()
        self._graph.note_raw(sensor, serialized_ns(data), now_ns)
        take = partial(self._graph.add_raw, sensor, now_ns=now_ns)
        self._newest.put(f"4 raw {sensor}", SkeletonArray, data, take)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if self._prefix == "/" or status.name.startswith(self._prefix):
                self._graph.add_report(to_node_status(status, self._now_ns()))

    def _trigger(self, name: str) -> None:
        client = self._triggers[name]
        if not client.service_is_ready():
            self._answer(f"nobody offers {name}: is the {name.split('/')[0]} running?", False)
            return
        client.call_async(Trigger.Request()).add_done_callback(self._on_triggered)

    def _on_triggered(self, future: Any) -> None:
        response = future.result()
        if response is not None:
            self._answer(response.message, response.success)

    def _set_person(self, person: str) -> None:
        ready = [client for client in self._setters.values() if client.service_is_ready()]
        if not ready:
            self._answer("no fusion is running: the person cannot be selected", False)
            return
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=person)
        request = SetParameters.Request(parameters=[ParameterMessage(name="person", value=value)])
        for client in ready:
            client.call_async(request).add_done_callback(partial(self._on_set, person))

    def _on_set(self, person: str, future: Any) -> None:
        response = future.result()
        if response is None:
            return
        refusals = [result.reason for result in response.results if not result.successful]
        whom = f"person {person}" if person else "whoever comes first"
        self._answer(refusals[0] if refusals else f"following {whom}", not refusals)

    def _answer(self, text: str, is_good: bool) -> None:
        assert self.viewer.graph is not None
        self.viewer.graph.answer(text, is_good)
        log = self.get_logger().info if is_good else self.get_logger().warning
        log(text)

    def _report(self) -> Report:
        visitors = len(self.viewer.server.get_clients())
        message = f"{self.viewer.server.address}, {visitors} browsers"
        values = {"visitors": visitors, **self._graph.counters.as_dict()}
        return Report(level=Level.OK, message=message, values=values)

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def destroy_node(self) -> None:
        """Close the page and destroy the node."""
        viewer = getattr(self, "viewer", None)
        if viewer is not None:
            viewer.server.stop()
        super().destroy_node()


def run_viewer(options: Mapping[str, Any]) -> None:
    """Run the node with these parameters, None: the default, and exit."""
    overrides = overrides_of(ViewParameters, options)
    run_node(lambda: ViewerNode(parameter_overrides=overrides), [])


def main() -> None:
    """Entry point of the executable."""
    run_node(ViewerNode, parameters=ViewParameters)
