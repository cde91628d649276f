"""A plot of tele-operation: the person's target angles, the command, the robot."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from pose_evaluation.plots import DPI
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
    figure = Figure(figsize=(12.0, 1.6 + 1.7 * len(shown)), dpi=DPI, layout="constrained")
    figure.suptitle(title, fontsize=13, x=0.01, ha="left")
    plots = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    begin_ns = int(motions["command"].recorded_ns[0])
    end_s = (int(motions["command"].recorded_ns[-1]) - begin_ns) * 1e-9
    for axes, joint in zip(plots, shown, strict=True):
        for name, motion in motions.items():
            times = (motion.recorded_ns - begin_ns) * 1e-9
            breaks = np.flatnonzero(np.diff(times) > GAP_S) + 1
            values = np.degrees(motion.position[:, motion.joints.index(joints[joint])])
            colour, width = STYLES[name]
            axes.plot(
                np.insert(times, breaks, np.nan),
                np.insert(values, breaks, np.nan),
                color=colour,
                linewidth=width,
                label=name,
            )
        axes.set_title(joints[joint].replace("_", " "), fontsize=10, loc="left", pad=3)
        axes.set_ylabel("[deg]", fontsize=9)
        axes.set_xlim(0.0, max(end_s, 0.1))
        axes.grid(color="0.88", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
    plots[-1].set_xlabel("time since the first command [s]", fontsize=10)
    handles, labels = plots[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=3, frameon=False, fontsize=11)
    return figure
