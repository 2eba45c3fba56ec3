"""Compilation of loops, and the cache of their machine code."""

import hashlib
import tempfile
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from typing import Any, cast

import platformdirs


class _Compiled:
    """A function that numba compiles when it, or a compiled function that calls it, is first called; numba is imported then."""

    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self.function = function

    def __call__(self, *values: Any) -> Any:
        return self.machine_code(*values)

    @property
    def _numba_type_(self) -> Any:
        return self.machine_code._numba_type_

    @cached_property
    def machine_code(self) -> Any:
        """The function that numba has compiled."""
        import numba

        if not can_keep(kept_code()):
            return numba.njit(error_model="numpy")(self.function)
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(kept_code())  # numba reads the setting here, and not again for this function
        try:
            return numba.njit(cache=True, error_model="numpy")(self.function)
        finally:
            numba.config.CACHE_DIR = before


def compiled[F: Callable[..., Any]](function: F) -> F:
    """``function`` as machine code for one thread: compiled at the first call, and stored on disk if the disk is writable."""
    return cast(F, _Compiled(function))


@cache
def can_keep(folder: Path) -> bool:
    """True if files can be written in ``folder``, which is created; False for a relative path (a user without a home folder)."""
    if not folder.is_absolute():
        return False
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@cache
def kept_code() -> Path:
    """The folder in which the machine code of these loops is stored; it may be deleted.

    A compiled function contains the functions that it calls, but numba checks only the function's own file for changes. So the
    folder's name is a hash of all files of kernels.
    """
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*_kernels.py")):
        digest.update(path.read_bytes())
    return platformdirs.user_cache_path("fem_reference") / "compiled" / digest.hexdigest()[:16]
