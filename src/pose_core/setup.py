"""For colcon; pyproject.toml describes the package."""

from setuptools import setup

setup(python_requires=">=3.10")
