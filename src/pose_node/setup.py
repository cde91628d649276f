"""Build description of the package, for colcon."""

from setuptools import find_packages, setup

package_name = "pose_node"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml", "README.md"]),
    ],
    extras_require={"test": ["pytest"]},
    description="What the executables of pose fusion share",
    license="Apache-2.0",
    entry_points={"console_scripts": ["bring_up = pose_node.entry:start.pose_node.nodes.bring_up"]},
)
