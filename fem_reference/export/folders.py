"""The folder of an export: a new one, written whole or not at all."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fem_reference.foundations.errors import InputError
from fem_reference.io import files


def check(folder: Path) -> None:
    """Raise InputError unless ``folder`` is missing or empty."""
    if folder.is_file():
        raise InputError("--to", f'"{folder}", a file', "a folder that is not there yet, or empty")
    if folder.is_dir() and any(folder.iterdir()):
        raise InputError("--to", f'"{folder}", which is not empty', "a folder that is not there yet, or empty")


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """A folder to write into: ``folder`` when all went well, else gone; InputError where that is not free."""
    folder = folder.resolve()
    check(folder)
    files.clear(folder)
    part = folder.with_name(f".{folder.name}-{os.getpid()}")
    above = [parent for parent in part.parents if not parent.exists()]
    files.make_folder(part)
    try:
        yield part
        part.replace(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)
        for parent in above:
            with suppress(OSError):  # where something is in it, as when all went well
                parent.rmdir()
