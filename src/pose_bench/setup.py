"""Build description of the package, for colcon."""

from setuptools import find_packages, setup

package_name = "pose_bench"

setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(),
    package_data={"pose_bench": ["seeds/*.seed", "papers/*.csv"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml", "README.md"]),
    ],
    extras_require={"test": ["pytest"]},
    description="Benchmarks: how accurate the estimators are",
    license="Apache-2.0",
    entry_points={"console_scripts": ["bench = pose_node.entry:start.pose_bench.tools.bench"]},
)
