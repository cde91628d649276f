"""What is installed is pinned, and known by its hash."""

import re
from pathlib import Path

import pytest

REQUIREMENTS = Path(__file__).resolve().parents[3] / "requirements"
LOCKS = sorted(REQUIREMENTS.glob("*.txt"))


@pytest.mark.parametrize("lock", LOCKS, ids=lambda lock: lock.name)
def test_every_package_is_pinned_and_hashed(lock):
    text = lock.read_text().replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]

    assert lines
    for line in lines:
        how = f"{line.split()[0]}: run scripts/lock_requirements.sh"
        assert re.match(r"[\w.-]+==", line), how
        assert "--hash=sha256:" in line, how


@pytest.mark.parametrize("lock", LOCKS, ids=lambda lock: lock.name)
def test_a_lock_contains_every_requirement(lock):
    pinned = {line.split("==")[0].lower() for line in lock.read_text().splitlines() if "==" in line}
    asked = {
        re.split(r"[<>= ;\[]", line.lower())[0]
        for line in lock.with_suffix(".in").read_text().splitlines()
        if line and not line.startswith("#")
    }

    assert asked <= pinned
