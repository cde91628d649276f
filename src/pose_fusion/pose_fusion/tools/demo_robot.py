"""What the demo says of the robot that followed: how near, how late, and a plot."""

import numpy as np
from rich.console import Console
from rich.text import Text

from pose_evaluation.plots import save_figure
from pose_evaluation.robot_plot import robot_figure
from pose_fusion.tools.demo_processes import DemoRun
from pose_io.bags import BagReader
from pose_io.robot_motion import COMMAND, ROBOT, TARGET, read_joint_motion

PLOT = "robot.png"


def draw_robot(bag: BagReader, run: DemoRun, console: Console) -> tuple[str, ...]:
    """Draw and describe the robot's motion; the plot's name, nothing if there was no robot."""
    topics = {"person": TARGET, "command": COMMAND, "robot": ROBOT}
    found = {name: read_joint_motion(bag, topic) for name, topic in topics.items()}
    motions = {name: each for name, each in found.items() if each is not None}
    if len(motions) < len(topics):
        return ()
    save_figure(robot_figure(f"Robot: {run.subject}", motions), run.folder / PLOT)
    target, command, robot = (motions[name] for name in topics)
    measured = np.stack(
        [
            np.interp(target.recorded_ns, robot.recorded_ns, robot.position[:, i])
            for i in range(robot.position.shape[1])
        ],
        axis=1,
    )
    error = np.degrees(np.abs(measured - target.position))
    latency_ms = (command.recorded_ns - command.stamps_ns) * 1e-6
    median, p99 = np.percentile(latency_ms, [50.0, 99.0])
    text = (
        f"{len(command.stamps_ns)} commands; from the person's pose "
        f"{np.median(error):.1f}°, p95 {np.percentile(error, 95.0):.1f}° (soft starts too); "
        f"capture to command {median:.1f} ms, p99 {p99:.1f}"
    )
    console.print(Text(f"{'robot':<14}{text}"), soft_wrap=True)
    return (PLOT,)
