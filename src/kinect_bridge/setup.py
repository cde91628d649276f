"""Build description of the package, for colcon."""

from glob import glob

from setuptools import find_packages, setup

package_name = "kinect_bridge"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml", "README.md"]),
        (f"share/{package_name}/config", glob("config/*.yaml")),
        (f"share/{package_name}/launch", glob("launch/*.launch.yaml")),
    ],
    extras_require={"test": ["pytest"]},
    description="Skeletons of one sensor, live or recorded, as ROS messages",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "kinect_bridge = pose_node.entry:start.kinect_bridge.nodes.kinect_bridge",
            "inspect = pose_node.entry:start.kinect_bridge.tools.inspect",
        ]
    },
)
