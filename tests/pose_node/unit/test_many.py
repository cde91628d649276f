"""Options of a run over a folder of recordings."""

import argparse

import pytest

from pose_core.errors import InputError
from pose_node.many import add_many_arguments


@pytest.mark.parametrize("count", ["0", "-2"])
def test_no_process_at_all_is_refused(count):
    parser = argparse.ArgumentParser()
    add_many_arguments(parser)

    with pytest.raises(InputError, match=f"jobs = {count}: expected 1 or more"):
        parser.parse_args(["--jobs", count])
