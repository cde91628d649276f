"""Checks that callers of type-specialised kernels pass the same types, in the tests' process."""

from typing import Any

import numba
import numpy as np

from pose_core.kernels import compiling


def layout(argument: Any) -> Any:
    """All that numba's type of an argument depends on; found in a twentieth of the time."""
    kind = type(argument)
    if kind is np.ndarray:
        flags = argument.flags
        contiguous = flags.c_contiguous, flags.f_contiguous
        return argument.dtype, argument.ndim, contiguous, flags.writeable
    if isinstance(argument, tuple):
        return kind, tuple(map(layout, argument))
    return kind if kind in (bool, float) else numba.typeof(argument)


def checked(type_specialised):
    """The decorator, whose kernels look at the types at every call."""

    def decorate(kernel):
        call, settled_for = type_specialised(kernel), None
        sound, parameters = set(), {}

        def layout_at(place: int, argument: Any) -> Any:
            """Its layout; found once of a tuple that is the same object in the next call."""
            if not isinstance(argument, tuple):
                return layout(argument)
            if place not in parameters or parameters[place][0] is not argument:
                parameters[place] = argument, layout(argument)
            return parameters[place][1]

        def look(*arguments: Any) -> Any:
            nonlocal settled_for
            seen = tuple(map(layout_at, range(len(arguments)), arguments))
            if seen not in sound:
                types = tuple(map(numba.typeof, arguments))
                if settled_for is None:
                    settled_for = types
                if types != settled_for:
                    raise TypeError(f"{kernel.__name__} was settled for {settled_for}, got {types}")
                sound.add(seen)
            return call(*arguments)

        return look

    return decorate


def check_settled_kernels() -> None:
    """From now on; to be called before any module that settles a kernel is imported."""
    compiling.type_specialised = checked(compiling.type_specialised)
