import json
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from pose_fusion.nodes.monitor import MonitorNode


def test_each_status_is_one_line_of_json(ros_context, capsys):
    ros_context.add(MonitorNode())
    publisher = ros_context.make_node().create_publisher(DiagnosticArray, "/diagnostics", 10)
    ros_context.spin_until(lambda: publisher.get_subscription_count() > 0, what="the monitor")
    status = DiagnosticStatus(
        level=DiagnosticStatus.WARN,
        name="/fusion",
        message="two\nlines",
        values=[KeyValue(key="estimates", value="12")],
    )
    publisher.publish(DiagnosticArray(status=[status]))
    printed: list[str] = []

    def came() -> bool:
        printed.extend(capsys.readouterr().out.splitlines())
        return len(printed) >= 2

    ros_context.spin_until(came, what="the status")
    ready, report = (json.loads(line) for line in printed)
    assert ready == {"ready": True}
    assert abs(report.pop("received_ns") - time.time_ns()) < 60e9
    assert report == {
        "name": "/fusion",
        "level": 1,
        "message": "two\nlines",
        "values": {"estimates": "12"},
    }
