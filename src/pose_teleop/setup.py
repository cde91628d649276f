"""Build description of the package, for colcon."""

from glob import glob

from setuptools import find_packages, setup

package_name = "pose_teleop"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(),
    package_data={package_name: ["robots/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml", "README.md"]),
        (f"share/{package_name}/config", glob("config/*.yaml")),
        (f"share/{package_name}/launch", glob("launch/*.launch.yaml")),
    ],
    extras_require={"test": ["pytest"]},
    description="A robot follows a person's joint angles",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "arm = pose_node.entry:start.pose_teleop.nodes.arm",
            "hold = pose_node.entry:start.pose_teleop.nodes.hold",
            "hri = pose_node.entry:start.pose_teleop.nodes.hri",
            "retarget = pose_node.entry:start.pose_teleop.nodes.retarget",
            "simulated_robot = pose_node.entry:start.pose_teleop.nodes.simulated_robot",
        ]
    },
)
