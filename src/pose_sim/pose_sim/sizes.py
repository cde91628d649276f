"""Sizes of simulated errors: their declaration as parameters, and presets by a factor."""

from collections.abc import Collection
from dataclasses import replace
from typing import Any, TypeVar

from pose_core.parameters import parameter

T = TypeVar("T")


def size(default: float, unit: str, largest: float, doc: str) -> Any:
    """Declare a parameter from 0 to ``largest``, in ``unit``; ``doc`` says what it does."""
    return parameter(default, unit=unit, limits=(0.0, largest), doc=doc)


def scaled(typical: T, factor: float, alike: Collection[str]) -> T:
    """Parameters with all sizes times a factor, except for those that are ``alike``."""
    sizes = {name: factor * value for name, value in vars(typical).items() if name not in alike}
    return replace(typical, **sizes)  # type: ignore[type-var]
