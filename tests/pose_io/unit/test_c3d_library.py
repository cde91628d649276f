import sys

import pytest

from pose_core.errors import InputError
from pose_io.c3d_library import c3d_library
from pose_io.export.registry import EXPORTERS


def test_without_the_library_c3d_files_are_refused_with_instructions_and_others_work(monkeypatch):
    monkeypatch.setitem(sys.modules, "c3d", None)

    with pytest.raises(InputError, match=r"pip install 'pose_io\[c3d\]'"):
        c3d_library()
    assert "trc" in EXPORTERS
