"""Build description of the package, for colcon."""

from glob import glob

from setuptools import find_packages, setup

package_name = "pose_fusion"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml", "README.md"]),
        (f"share/{package_name}/config", glob("config/*.yaml")),
        (f"share/{package_name}/launch", glob("launch/*.launch.yaml")),
        (f"share/{package_name}/rviz", glob("rviz/*.rviz")),
        (f"share/{package_name}/foxglove", glob("foxglove/*.json")),
    ],
    extras_require={"test": ["pytest"]},
    description="Calibration, fusion and recording of one person's pose",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "calibration = pose_node.entry:start.pose_fusion.nodes.calibration",
            "fusion = pose_node.entry:start.pose_fusion.nodes.fusion",
            "player = pose_node.entry:start.pose_fusion.nodes.player",
            "policy = pose_node.entry:start.pose_fusion.nodes.policy",
            "recorder = pose_node.entry:start.pose_fusion.nodes.recorder",
            "calibrate = pose_node.entry:start.pose_fusion.tools.calibrate",
            "demo = pose_node.entry:start.pose_fusion.tools.demo",
            "export = pose_node.entry:start.pose_fusion.tools.export",
            "doctor = pose_node.entry:start.pose_fusion.tools.doctor",
            "fuse = pose_node.entry:start.pose_fusion.tools.fuse",
            "top = pose_node.entry:start.pose_fusion.nodes.top",
        ]
    },
)
