"""``view``: its errors on bad input."""

import pytest

from pose_core.errors import InputError, ParameterError
from pose_view.tools.view import view


def test_a_bag_that_is_none_is_named(tmp_path):
    with pytest.raises(InputError, match="nothing_here"):
        view([str(tmp_path / "nothing_here")])


def test_a_rate_that_cannot_be_is_refused(tmp_path):
    with pytest.raises(ParameterError, match=r"rate = 500\.0 Hz is outside \[1, 120\]"):
        view([str(tmp_path), "--rate", "500"])
