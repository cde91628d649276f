import re

import pytest
from readme_tables import SRC, generated_part, markdown_table

from pose_view.parameters import ViewParameters
from pose_view.tools.view import view

OF_OTHERS = {"--view", "--bag"}  # of ./pose demo and of scripts/measure_viewer.sh


def test_the_readmes_parameters_are_those_of_the_viewer():
    assert generated_part("pose_view", "parameters: viewer") == markdown_table(ViewParameters)


def test_the_viewer_has_the_options_that_its_readme_names(capsys):
    readme = (SRC / "pose_view" / "README.md").read_text().split("## The report")[0]

    with pytest.raises(SystemExit):
        view(["--help"])

    named = set(re.findall(r"(?<=[`\s])--[a-z][a-z-]*", readme))
    assert "--bodies" in named
    assert named - OF_OTHERS <= set(re.findall(r"--[a-z-]+", capsys.readouterr().out))
