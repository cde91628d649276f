"""Names of modules, classes and functions are the field's, not private ones."""

import ast
import re
from pathlib import Path

SRC = Path(__file__).resolve().parents[3] / "src"
PRIVATE = {
    "telling": "output",
    "tell": "output",
    "gliding": "output blending",
    "glide": "output blending",
    "handover": "output blending",
    "placing": "forward kinematics",
    "seeing": "camera geometry",
    "mountings": "sensor-to-segment alignment",
    "strapping": "sensor-to-segment alignment",
    "learning": "session calibration",
    "lean": "inclination",
    "beside": "bias",
    "fresh": "high-passed signal",
    "reopened": "covariance reset",
}
"""Words that have been in names once, and what the field says."""


def names(path):
    """The module's name, and those that it defines."""
    yield path.stem
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield node.name


def words(name):
    """The words of a name, in lower case."""
    return {word.lower() for word in re.findall(r"[A-Z]?[a-z0-9]+", name)}


def test_no_name_has_a_private_word():
    found = [
        f"{path.relative_to(SRC)}: {name}: {word} is {PRIVATE[word]}"
        for path in sorted(SRC.rglob("*.py"))
        for name in names(path)
        for word in words(name) & PRIVATE.keys()
    ]
    assert not found, "\n".join(found)
