"""Checks that callers of type-specialised kernels pass the same types, in the tests' process."""

from typing import Any

import numba

from pose_core.kernels import compiling


def checked(type_specialised):
    """The decorator, whose kernels look at the types at every call."""

    def decorate(kernel):
        call, settled_for = type_specialised(kernel), None

        def look(*arguments: Any) -> Any:
            nonlocal settled_for
            types = tuple(map(numba.typeof, arguments))
            if settled_for is None:
                settled_for = types
            if types != settled_for:
                raise TypeError(f"{kernel.__name__} was settled for {settled_for}, got {types}")
            return call(*arguments)

        return look

    return decorate


def check_settled_kernels() -> None:
    """From now on; to be called before any module that settles a kernel is imported."""
    compiling.type_specialised = checked(compiling.type_specialised)
