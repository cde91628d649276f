from readme_tables import generated_part, markdown_table

from pose_view.parameters import ViewParameters


def test_the_readmes_parameters_are_those_of_the_viewer():
    assert generated_part("pose_view", "parameters: viewer") == markdown_table(ViewParameters)
