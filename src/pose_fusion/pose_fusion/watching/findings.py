"""Faults of a graph, with their remedies."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from pose_fusion.watching.cameras import NO_IMUS
from pose_fusion.watching.observation import GraphSnapshot, TopicStatus
from pose_fusion.watching.stages import reported_stages
from pose_io.topics import BODY_TOPIC, IMU_TOPIC, SENSOR_TOPIC
from pose_node.node_status import Level

SLOWEST_SENSOR = 10.0  # [Hz] a Kinect gives 30
MAX_LATENCY_S = 0.1  # [s] of a stage
MAX_LEAD_S = 0.05  # [s] a stamp may lie in the future


class Verdict(Enum):
    """How a finding counts."""

    OK = "ok"
    NOTE = "note"
    WRONG = "wrong"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    subject: str
    verdict: Verdict
    found: str
    remedy: str = ""  # what to do, if anything


def ok(subject: str, found: str) -> Finding:
    """Something as it should be."""
    return Finding(subject, Verdict.OK, found)


def note(subject: str, found: str, remedy: str) -> Finding:
    """Something that may be meant."""
    return Finding(subject, Verdict.NOTE, found, remedy)


def wrong(subject: str, found: str, remedy: str) -> Finding:
    """A fault to be mended."""
    return Finding(subject, Verdict.WRONG, found, remedy)


def graph_findings(snapshot: GraphSnapshot) -> list[Finding]:
    """All findings in a graph's state."""
    if not snapshot.hears_itself:
        remedy = "look at shared memory and loopback above; is a firewall in the way?"
        return [wrong("messages", "a message to itself did not come back", remedy)]
    findings = [ok("messages", "a message to itself came back")]
    if not snapshot.topics and not snapshot.statuses:
        text = f"no node of pose fusion runs on this ROS domain ({len(snapshot.nodes)} other nodes)"
        return [*findings, note("nodes", text, "./pose up starts a graph")]
    findings.append(ok("nodes", ", ".join(snapshot.nodes)))
    for find in (_sensors, _several_publishers, _extrinsics, _output, _statuses):
        findings += find(snapshot)
    return findings


def _sensors(snapshot: GraphSnapshot) -> Iterator[Finding]:
    kinects = [topic for topic in snapshot.topics if SENSOR_TOPIC.search(topic.name)]
    imus = [topic for topic in snapshot.topics if IMU_TOPIC.search(topic.name)]
    if not kinects:
        remedy = "start a kinect_bridge: ./pose up recording:=FILE, or your own tracker"
        yield wrong("skeletons", "nobody publishes kinect_<name>/skeletons", remedy)
    for topic in kinects:
        yield _stream(topic, SLOWEST_SENSOR)
    silent = [topic for topic in imus if topic.rate == 0.0]
    if silent:
        names = ", ".join(topic.name for topic in silent)
        yield wrong("IMUs", f"silent: {names}", "is each switched on and in the nodes file?")
    elif imus:
        slowest = min(topic.rate for topic in imus)
        yield ok("IMUs", f"{len(imus)} flow, at {slowest:.0f} Hz or more")


def _several_publishers(snapshot: GraphSnapshot) -> Iterator[Finding]:
    """Topics of one sensor or one person's angles that several nodes publish."""
    for topic in snapshot.topics:
        is_sensor = SENSOR_TOPIC.search(topic.name) or IMU_TOPIC.search(topic.name)
        if topic.publishers > 1 and (is_sensor or topic.name.endswith("/joint_states")):
            remedy = "started twice? stop all but one; one that was killed counts for 20 s"
            yield wrong(topic.name, f"{topic.publishers} publishers", remedy)


def _stream(topic: TopicStatus, slowest: float) -> Finding:
    """A sensor's stream: rate, age, latency."""
    if topic.rate == 0.0:
        return wrong(topic.name, "silent", "look at its bridge: is the sensor there?")
    text = f"{topic.rate:.1f} Hz"
    if topic.rate < slowest:
        remedy = f"expected {slowest:g} Hz or more: is the machine too busy?"
        return wrong(topic.name, text, remedy)
    if topic.latency_s is None:
        return ok(topic.name, text)
    text += f", {1000.0 * topic.latency_s:.0f} ms from capture to here"
    if topic.latency_s < -MAX_LEAD_S:
        return wrong(topic.name, text, "stamps lie in the future: set both hosts' clocks by NTP")
    if topic.latency_s > MAX_LATENCY_S:
        remedy = "late: a replayed recording, clocks that differ, or a machine that is too busy"
        return note(topic.name, text, remedy)
    return ok(topic.name, text)


def _extrinsics(snapshot: GraphSnapshot) -> Iterator[Finding]:
    sensors = [
        match["name"] for topic in snapshot.topics if (match := SENSOR_TOPIC.search(topic.name))
    ]
    missing = [name for name in sensors if name not in snapshot.placed_sensors]
    if sensors and not missing:
        yield ok("extrinsics", f"known of {', '.join(snapshot.placed_sensors)}")
    elif missing:
        calibrates = any(node.split("/")[-1] == "calibration" for node in snapshot.nodes)
        text = f"not known of {', '.join(missing)}"
        if calibrates:
            remedy = "raise the arms, walk about: the calibration is waiting for motion"
            yield note("extrinsics", text, remedy)
        else:
            remedy = "start the calibration (fusion.launch.yaml), or give the fusion"
            yield wrong("extrinsics", text, f"{remedy} extrinsics_file")


def _output(snapshot: GraphSnapshot) -> Iterator[Finding]:
    outputs = [
        (topic, topic.name[: match.start()], match["body"])
        for topic in snapshot.topics
        if (match := BODY_TOPIC.search(topic.name)) and match["leaf"] == "joint_states"
    ]
    for topic, namespace, body in outputs:
        if topic.rate == 0.0:
            said = [
                status.message
                for status in snapshot.statuses
                if status.name.startswith(f"{namespace}/fusion")
                and status.values.get("subject", body) == body
            ]
            why = f"the fusion says: {said[0]}" if said else "look at the fusion's output"
            find = note if said and said[0].startswith(NO_IMUS) else wrong
            yield find(topic.name, "silent", why)
        else:
            yield ok(topic.name, f"{topic.rate:.1f} Hz")
    if snapshot.fusion_latency_s is not None:
        median, p99 = (1000.0 * value for value in snapshot.fusion_latency_s)
        text = f"median {median:.0f} ms, p99 {p99:.0f} ms, from newest sample to output"
        if snapshot.fusion_latency_s[0] > MAX_LATENCY_S:
            yield wrong("fusion latency", text, "the machine is too busy: fewer nodes, more cores")
        else:
            yield ok("fusion latency", text)
    for status in snapshot.statuses:
        for stage, text in reported_stages(status.values).items():
            subject = f"{status.name}: latency, {stage.replace('_', ' ')}"
            yield ok(subject, f"median {text} ms")


def _statuses(snapshot: GraphSnapshot) -> Iterator[Finding]:
    for status in snapshot.statuses:
        if status.level is Level.OK:
            yield ok(status.name, status.message)
        else:
            find = note if status.level is Level.WARN else wrong
            yield find(status.name, status.message, "its README says what to do")
