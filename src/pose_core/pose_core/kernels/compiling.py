"""Compilation of the kernels by numba, and the folder of the compiled code.

Numba compiles a function when it is first called and keeps the result for the next process. It
looks only at the function's own file to see whether that is out of date, and the kernels call each
other across files: so the folder's name tells the content of all of them. The folder is given to
numba for our functions alone; nothing of numba's own settings stays changed.
"""

import hashlib
import logging
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

PACKAGE = Path(__file__).parents[1]
MARK = b"@compiled"  # what a file with kernels holds
FOLDER_VARIABLE = "NUMBA_CACHE_DIR"  # numba's own; whoever sets it is obeyed


def _sources_hash() -> str:
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        content = path.read_bytes()
        if MARK in content:
            digest.update(content)
    return digest.hexdigest()[:12]


def _make_folder() -> Path:
    """The folder of the compiled code: the user's cache, else one that goes with the system."""
    if FOLDER_VARIABLE in os.environ:
        return Path(os.environ[FOLDER_VARIABLE]) / _sources_hash()
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    folder = base / "pose_core" / "kernels" / _sources_hash()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    # Nobody else's files may be run: a new folder, which only we can write to.
    return Path(tempfile.mkdtemp(prefix="pose_core_kernels_"))


COMPILED_FOLDER = _make_folder()


@contextmanager
def _kept_in_our_folder() -> Iterator[None]:
    """Numba asks its settings where to keep a function at the moment it is decorated."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(COMPILED_FOLDER)
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before


_OPTIONS: dict[str, Any] = {
    "cache": True,
    # As in numpy, a division by zero gives infinity; an exception would cost a branch each time.
    "error_model": "numpy",
    # a b + c in one instruction, rounded once.
    "fastmath": {"contract"},
}


def compiled(function: F) -> F:
    """Compile a function at its first call, and keep the result."""
    with _kept_in_our_folder():
        return cast(F, numba.njit(**_OPTIONS)(function))


def compiled_in_place(function: F) -> F:
    """The same for a function that makes no arrays, but only fills and reads those it is given.

    Numba counts references to an array at every view of it (``rotations[link]``), by an atomic
    instruction that costs 6 ns, as long as the product of two small matrices. The caller of such a
    function holds the arrays meanwhile, so reference counting is switched off here. The function
    must not call one that returns an array and counts: that array would never be freed.
    """
    # The option is numba's own; with it, a function that makes an array does not compile.
    with _kept_in_our_folder():
        return cast(F, numba.njit(**_OPTIONS, _nrt=False)(function))


def type_specialised(kernel: F) -> F:
    """A type-specialised kernel, for a caller whose arguments keep their types.

    Only the first call's types are looked at. Numba otherwise determines the type of each argument,
    and of every element of a tuple, at every call, which takes 0.2 µs each: longer than some
    kernels take. So an array must stay of its type and of its number of dimensions, and of
    contiguous rows if it was at first: else it would be taken for what it is not.
    (``tests/support/checked_kernels.py`` checks that in the tests' own process.)
    """
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


def announce_compilation() -> None:
    """Log one line before the first start, which compiles and takes longer than later ones."""
    if not any(COMPILED_FOLDER.rglob("*.nbi")):
        logging.getLogger("pose_core").warning(
            "first start: compiling the estimator for this machine, which takes a minute or two "
            "(kept in %s)",
            COMPILED_FOLDER,
        )
