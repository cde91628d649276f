"""Fuses a recording of two Kinects into joint angles, without ROS.

The first start compiles the estimator for this machine, which takes a minute or two.
"""

import argparse
import sys

import matplotlib.pyplot as plt
import numpy as np

from pose_calibration.session_calibration import calibrate
from pose_core.api import PoseError, fuse
from pose_io.samples import read_samples

ANGLE = "left_knee_flexion"


def main(recording: str, plot: str) -> None:
    """Calibrate from the motion, fuse, print and plot one angle with its standard deviation."""
    recorded = read_samples(recording)
    extrinsics = calibrate(recorded.samples, recorded.sensors).extrinsics
    series = fuse(recorded.samples, extrinsics)
    column = series.names.index(ANGLE)
    time_s = (series.stamps_ns - series.stamps_ns[0]) * 1e-9
    angle, stddev = (np.degrees(a[:, column]) for a in (series.position, series.position_stddev))
    plt.plot(time_s, angle)
    plt.fill_between(time_s, angle - stddev, angle + stddev, alpha=0.3)
    plt.gca().set(xlabel="time [s]", ylabel=f"{ANGLE} [deg]")
    plt.savefig(plot)
    print(f"{len(series.stamps_ns)} poses, {len(series.names)} degrees of freedom")
    print(f"{ANGLE}: {angle.min():.1f} to {angle.max():.1f} deg, stddev {stddev.mean():.1f} deg")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", help="a bag, or skeletons: src/kinect_bridge/README.md")
    parser.add_argument("plot", nargs="?", default="angles.png", help="(default: angles.png)")
    arguments = parser.parse_args()
    try:
        main(arguments.recording, arguments.plot)
    except PoseError as error:
        sys.exit(str(error))
