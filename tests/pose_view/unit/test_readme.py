import re
from pathlib import Path

from readme_tables import markdown_table

from pose_view.parameters import ViewParameters

README = Path(__file__).parents[3] / "src" / "pose_view" / "README.md"


def test_the_readmes_parameters_are_those_of_the_viewer():
    marked = r"<!-- parameters: viewer -->\n(.*?)<!-- /parameters: viewer -->"
    found = re.search(marked, README.read_text(), re.DOTALL)
    assert found, "no parameters of the viewer in the README"
    assert found[1] == markdown_table(ViewParameters)
