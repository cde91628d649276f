"""Build description of the package, for colcon."""

from glob import glob

from setuptools import find_packages, setup

package_name = "pose_sim"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(),
    package_data={"pose_sim.captured": ["clips/*.npz", "tables/*.npz", "*/README.md"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml", "README.md"]),
        (f"share/{package_name}/launch", glob("launch/*.launch.yaml")),
    ],
    extras_require={"test": ["pytest"]},
    description="A synthetic subject with virtual Kinects and IMUs",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "generate = pose_node.entry:start.pose_sim.tools.generate",
            "imu_device = pose_node.entry:start.pose_sim.tools.imu_device",
        ]
    },
)
