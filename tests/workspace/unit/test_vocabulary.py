"""Names are the field's words, not private ones."""

import ast
import re
from pathlib import Path

SRC = Path(__file__).resolve().parents[3] / "src"
PRIVATE = {
    "telling": "output",
    "tell": "output",
    "tells": "output",
    "told": "output",
    "spoken": "label",
    "gliding": "output blending",
    "glide": "output blending",
    "handover": "output blending",
    "placing": "forward kinematics",
    "seeing": "camera geometry",
    "looks": "measurements",
    "felt": "vertical, or IMU sample",
    "mountings": "sensor-to-segment alignment",
    "strapping": "sensor-to-segment alignment",
    "learn": "estimation",
    "learnt": "estimation",
    "learning": "session calibration",
    "follower": "tracker",
    "following": "filter steps",
    "lean": "inclination",
    "leant": "inclination",
    "steepness": "inclination",
    "beside": "bias",
    "fresh": "high-passed signal",
    "reopened": "covariance reset",
}
"""Words that have been in names once, and what the field says."""
OF_VARIABLES = PRIVATE.keys() - {"beside", "following", "fresh", "lean", "looks"}
"""Those that are no plain English words for a variable, parameter or field either."""


def definitions(tree):
    """Names of classes and functions."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield node.name


def variables(tree):
    """Names of parameters, and of variables, attributes and fields where they are assigned."""
    for node in ast.walk(tree):
        if isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr


def private_words(path, names, private):
    """One line for each private word in the names."""
    for name in sorted(set(names)):
        words = {word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z0-9]+", name)}
        for word in sorted(words & private):
            yield f"{path.relative_to(SRC)}: {name}: {word} is {PRIVATE[word]}"


def test_no_name_has_a_private_word():
    found = []
    for path in sorted(SRC.rglob("*.py")):
        tree = ast.parse(path.read_text())
        defined = {path.stem, *definitions(tree)}
        found += private_words(path, defined, PRIVATE.keys())
        found += private_words(path, variables(tree), OF_VARIABLES)
    assert not found, "\n".join(found)
