"""The parameter files that launch files pass on."""

from pathlib import Path

import pytest
import yaml

FILES = sorted(
    path
    for path in Path(__file__).resolve().parents[3].glob("src/*/config/*.yaml")
    if "ros__parameters" in path.read_text()
)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_parameter_files_have_only_the_wildcard_section(path):
    assert list(yaml.safe_load(path.read_text())) == ["/**"]
