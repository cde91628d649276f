"""Build description of the package, for colcon."""

from glob import glob

from setuptools import find_packages, setup

package_name = "pose_view"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(),
    package_data={f"{package_name}.report": ["templates/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml", "README.md"]),
        (f"share/{package_name}/launch", glob("launch/*.launch.yaml")),
    ],
    extras_require={"test": ["pytest"], "viewer": ["viser>=1.1.1,<2"]},
    description="The live viewer in the browser and the report of a recording",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "report = pose_node.entry:start.pose_view.tools.report",
            "view = pose_node.entry:start.pose_view.tools.view",
            "viewer = pose_node.entry:start.pose_view.nodes.viewer",
        ]
    },
)
