"""Compilation of numerical loops by numba, and the cache for their machine code."""

import hashlib
import tempfile
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from typing import Any, cast

import platformdirs


class _Compiled:
    """A function that numba compiles at its first call, or at the first call of a compiled function that uses it.

    Only then is numba imported.
    """

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
        """The compiled function."""
        import numba

        if not can_keep(kept_code()):
            return numba.njit(error_model="numpy")(self.function)
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(kept_code())  # numba reads this setting once, while it creates the function
        try:
            return numba.njit(cache=True, error_model="numpy")(self.function)
        finally:
            numba.config.CACHE_DIR = before


def compiled[F: Callable[..., Any]](function: F) -> F:
    """``function`` as machine code for one thread, compiled at the first call and stored on disk if the disk is writable."""
    return cast(F, _Compiled(function))


@cache
def can_keep(folder: Path) -> bool:
    """True if files can be written in ``folder``, which is created if necessary.

    False for a relative path, which occurs if the user has no home folder.
    """
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
    """The folder in which machine code is stored. It may be deleted at any time.

    A compiled function contains the functions that it calls, but numba checks only the file of the function itself for changes.
    Therefore the name of the folder is a hash of all files with kernels.
    """
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*_kernels.py")):
        digest.update(path.read_bytes())
    return platformdirs.user_cache_path("fem_reference") / "compiled" / digest.hexdigest()[:16]
