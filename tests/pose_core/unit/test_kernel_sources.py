"""The hash under which compiled kernels are kept."""

import pytest

from pose_core.kernels.sources import sources_hash

FILES = {
    "kernel.py": "from pose_x.constants import LIMIT\n\n@compiled\ndef f():\n    return LIMIT\n",
    "constants.py": "LIMIT = 1.0\n",
    "other.py": "from pose_x.constants import LIMIT\n",
}


@pytest.mark.parametrize(
    ("name", "changes"), [("kernel.py", True), ("constants.py", True), ("other.py", False)]
)
def test_the_hash_changes_with_kernels_and_with_the_modules_that_they_import(
    tmp_path, name, changes
):
    package = tmp_path / "pose_x"
    package.mkdir()
    for each, text in FILES.items():
        (package / each).write_text(text)
    before = sources_hash(package)
    assert sources_hash(package) == before
    (package / name).write_text(FILES[name].replace("LIMIT", "MAXIMUM"))
    assert (sources_hash(package) != before) == changes
