"""A plot of tele-operation: the person's target angles, the command, the robot."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from pose_evaluation.plots import label_panel, titled_figure
from pose_io.robot_motion import JointMotion

GAP_S = 0.1  # [s] longer intervals interrupt the line
STYLES = {
    "person": ("#000000", 1.6),
    "command": ("#0072B2", 1.2),
    "robot": ("#D55E00", 0.9),
}


def robot_figure(title: str, motions: Mapping[str, JointMotion]) -> Figure:
    """The robot's joints over time, one small plot each.

    Args:
        title: Title.
        motions: ``person`` (target angles from the person's pose), ``command``, ``robot``.
    """
    joints = motions["command"].joints
    # Joints that never move are not drawn.
    spans = np.ptp(motions["command"].position, axis=0)
    shown = [i for i in range(len(joints)) if spans[i] > 0.01] or [0]
    figure = titled_figure(title, 1.6 + 1.7 * len(shown))
    plots = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    begin_ns = int(motions["command"].recorded_ns[0])
    end_s = (int(motions["command"].recorded_ns[-1]) - begin_ns) * 1e-9
    for axes, joint in zip(plots, shown, strict=True):
        for name, motion in motions.items():
            times = (motion.recorded_ns - begin_ns) * 1e-9
            breaks = np.flatnonzero(np.diff(times) > GAP_S) + 1
            values = np.degrees(motion.position[:, motion.joints.index(joints[joint])])
            colour, width = STYLES[name]
            points = np.insert([times, values], breaks, np.nan, axis=1)
            axes.plot(*points, color=colour, linewidth=width, label=name)
        label_panel(axes, joints[joint].replace("_", " "), "[deg]")
        axes.set_xlim(0.0, max(end_s, 0.1))
    plots[-1].set_xlabel("time since the first command [s]", fontsize=10)
    handles, labels = plots[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=3, frameon=False, fontsize=11)
    return figure
