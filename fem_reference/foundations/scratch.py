"""Folders for what processes pass to each other: gone at the end, and those that killed processes left at the next start."""

import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

_PREFIX, _LOCK = "fem_reference_scratch-", ".lock"
# So old [s] is a folder without a lock that nobody is about to take.
_SETTLED = 60.0


@contextmanager
def folder() -> Iterator[Path]:
    """A folder in the system's temporary one, locked as long as this process lives."""
    _clear(Path(tempfile.gettempdir()))
    with tempfile.TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True) as name, FileLock(Path(name) / _LOCK):
        yield Path(name)


def _clear(root: Path) -> None:
    """Remove what processes that were killed have left; what is not ours to remove stays."""
    for path in root.glob(f"{_PREFIX}*"):
        with suppress(OSError, Timeout):
            if time.time() - path.stat().st_mtime > _SETTLED and (path / _LOCK).is_file():
                with FileLock(path / _LOCK).acquire(timeout=0):
                    shutil.rmtree(path)
