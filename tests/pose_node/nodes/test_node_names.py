"""Our nodes leave rclpy's own attributes alone: its parameter services break without them."""

import ast
from pathlib import Path

from rclpy.node import Node

SRC = Path(__file__).resolve().parents[3] / "src"
MEANT = {"__init__", "destroy_node"}


def names_of(node_class):
    """What a class sets on itself, and its methods."""
    for part in ast.walk(node_class):
        if isinstance(part, ast.FunctionDef):
            yield part.name
        elif (
            isinstance(part, ast.Attribute)
            and isinstance(part.ctx, ast.Store)
            and isinstance(part.value, ast.Name)
            and part.value.id == "self"
        ):
            yield part.attr


def test_no_node_overrides_an_attribute_of_rclpys_node(ros_context):
    taken = (set(vars(ros_context.make_node())) | set(dir(Node))) - MEANT
    node_classes = {
        f"{path.stem}.{each.name}": each
        for path in SRC.glob("*/*/nodes/*.py")
        for each in ast.walk(ast.parse(path.read_text()))
        if isinstance(each, ast.ClassDef)
        and any(isinstance(base, ast.Name) and base.id == "Node" for base in each.bases)
    }

    assert len(node_classes) > 5
    hidden = {name: taken & set(names_of(each)) for name, each in node_classes.items()}
    assert {name: found for name, found in hidden.items() if found} == {}
