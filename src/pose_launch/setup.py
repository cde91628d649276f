"""Build description of the package, for colcon."""

from setuptools import find_packages, setup

package_name = "pose_launch"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml", "README.md"]),
    ],
    extras_require={"test": ["pytest"]},
    description="Runs ROS 2 YAML launch files where ros2 launch is missing",
    license="Apache-2.0",
    entry_points={"console_scripts": ["up = pose_node.entry:start.pose_launch.up"]},
)
