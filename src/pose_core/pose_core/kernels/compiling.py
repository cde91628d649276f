"""How the kernels are compiled, and where what comes of it is kept.

Numba compiles a function when it is first called and keeps the result for the next process. It
looks only at the function's own file to see whether that is out of date, and the kernels call each
other across files: so the folder's name tells the content of all of them.
"""

import hashlib
import logging
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

FOLDER_VARIABLE = "NUMBA_CACHE_DIR"  # numba's own; whoever sets it is obeyed


def _sources_hash() -> str:
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _make_folder() -> Path:
    """The folder of the compiled code: the user's cache, else one that goes with the system."""
    if FOLDER_VARIABLE in os.environ:
        return Path(os.environ[FOLDER_VARIABLE]) / _sources_hash()
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    folder = base / "pose_fusion" / "kernels" / _sources_hash()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    # Nobody else's files may be run: a new folder, which only we can write to.
    return Path(tempfile.mkdtemp(prefix="pose_fusion_kernels_"))


COMPILED_FOLDER = _make_folder()
numba.config.CACHE_DIR = str(COMPILED_FOLDER)


_OPTIONS: dict[str, Any] = {
    "cache": True,
    # As in numpy, a division by zero gives infinity; an exception would cost a branch each time.
    "error_model": "numpy",
    # a b + c in one instruction, rounded once.
    "fastmath": {"contract"},
}


def compiled(function: F) -> F:
    """Compile a function at its first call, and keep the result."""
    return cast(F, numba.njit(**_OPTIONS)(function))


def compiled_in_place(function: F) -> F:
    """The same for a function that makes no arrays, but only fills and reads those it is given.

    Numba counts who uses an array each time that a part of it is looked at (``rotations[link]``),
    by an atomic instruction that costs 6 ns, as long as a small matrix takes. Whoever calls such a
    function holds the arrays for that long: so here nothing is counted. It must not call one that
    returns an array and counts: that would never be given back.
    """
    # The option is numba's own; with it, a function that makes an array does not compile.
    return cast(F, numba.njit(**_OPTIONS, _nrt=False)(function))


def settled(kernel: F) -> F:
    """The kernel for a caller whose arguments are of the same types at every call.

    Only the first call's are looked at. Numba otherwise tells the type of each argument, and of all
    that is in a tuple, at every call, which takes it 0.2 µs each: longer than some kernels take. So
    an array must stay of its type and of its number of dimensions, and of contiguous rows if it was
    at first: else it would be taken for what it is not. (``tests/support/checked_kernels.py``
    checks that wherever tests call the code in their own process.)
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


def say_if_compiling() -> None:
    """One line before the first start, which takes longer than all others."""
    if not any(COMPILED_FOLDER.rglob("*.nbi")):
        logging.getLogger("pose_fusion").warning(
            "first start: compiling the estimator for this machine, which takes a minute or two "
            "(kept in %s)",
            COMPILED_FOLDER,
        )
