"""Compilation of the kernels by numba, and the folder of the compiled code.

Numba compiles a function at its first call and caches the result for the next process. To decide
whether the cache is out of date, it checks only the function's own file, but the kernels call each
other across files, and freeze constants of the modules that they import. So the name of the cache
folder is a hash of all of these. The folder is used for our functions only; numba's own settings
are restored.
"""

import logging
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

from pose_core.kernels.sources import sources_hash

F = TypeVar("F", bound=Callable[..., Any])

PACKAGE = Path(__file__).parents[1]
LARGEST = "step.update_with_frame"  # the kernel that takes longest to compile
FOLDER_VARIABLE = "NUMBA_CACHE_DIR"  # numba's own variable; it has precedence


def _make_folder() -> Path:
    """The folder of the compiled code: in the user's cache, otherwise a temporary folder."""
    if FOLDER_VARIABLE in os.environ:
        return Path(os.environ[FOLDER_VARIABLE]) / sources_hash(PACKAGE)
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    folder = base / "pose_core" / "kernels" / sources_hash(PACKAGE)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    # Files of other users must not be executed: create a folder that only we can write to.
    return Path(tempfile.mkdtemp(prefix="pose_core_kernels_"))


COMPILED_FOLDER = _make_folder()


@contextmanager
def _kept_in_our_folder() -> Iterator[None]:
    """Set numba's cache folder while a function is decorated, which is when numba reads it."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(COMPILED_FOLDER)
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before


_OPTIONS: dict[str, Any] = {
    "cache": True,
    # As in numpy, a division by zero gives infinity; raising an exception would cost a branch.
    "error_model": "numpy",
    # Allow a b + c in one instruction, with one rounding.
    "fastmath": {"contract"},
    # No kernel is passed as a function pointer; compilation takes a tenth less without this form.
    "no_cfunc_wrapper": True,
}


def compiled(function: F) -> F:
    """Compile a function at its first call, and cache the result."""
    return _compiled(function)


def _compiled(function: F, **options: Any) -> F:
    # The cache is found by the path of the source: one for imports through links and without.
    code = function.__code__
    function.__code__ = code.replace(co_filename=os.path.realpath(code.co_filename))
    with _kept_in_our_folder():
        return cast(F, numba.njit(**_OPTIONS, **options)(function))


def compiled_in_place(function: F) -> F:
    """Compile a function that allocates no arrays, but only reads and writes its arguments.

    Numba counts references to an array at every view of it (``rotations[link]``). The atomic
    instruction takes 6 ns, as long as a product of two small matrices. The caller of such a
    function holds the arrays meanwhile, so reference counting is switched off here. The function
    must not call one that returns an array with a reference count: it would never be freed.
    """
    # This is an option of numba; with it, a function that allocates an array does not compile.
    return _compiled(function, _nrt=False)


def compiled_into_caller(function: F) -> F:
    """Compile a function as a part of its callers, into which numba copies it.

    For a function with one or two callers: a kernel of its own would be optimised again within
    every kernel above it. Within it, references to arrays are counted if its caller counts them: a
    function that allocates no arrays is faster ``compiled_in_place`` if its caller is only
    ``compiled``. Calls cannot unpack arguments by ``*``.
    """
    return _compiled(function, inline="always")


def type_specialised(kernel: F) -> F:
    """A type-specialised kernel, for a caller whose arguments never change their types.

    Only the types of the first call are inspected. Numba otherwise determines the type of each
    argument, and of every element of a tuple, at every call. This takes 0.2 µs each, longer than
    some kernels. So the type, the number of dimensions and the contiguity of each array must not
    change; otherwise its memory would be misinterpreted.
    (``tests/support/checked_kernels.py`` checks that in the tests' own process.)
    """
    if numba.config.DISABLE_JIT:
        return kernel
    chosen: Callable[..., Any] | None = None

    def call(*arguments: Any) -> Any:
        nonlocal chosen
        if chosen is None:
            types = tuple(map(numba.typeof, arguments))
            dispatcher = cast(Any, kernel)
            dispatcher.compile(types)
            chosen = cast(Callable[..., Any], dispatcher.get_overload(types))
        return chosen(*arguments)

    return cast(F, call)


@cache
def announce_compilation() -> None:
    """Log one line before the first start, which compiles and takes longer than later ones."""
    if not any(COMPILED_FOLDER.rglob(f"{LARGEST}-*.nbi")):
        logging.getLogger("pose_core").warning(
            "first start: compiling the estimator for this machine, which takes a minute or two "
            "(kept in %s)",
            COMPILED_FOLDER,
        )
