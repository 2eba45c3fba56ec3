"""Delivery of the package's progress messages to a function of the caller."""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.given import said

Progress = Callable[[str], object]


@contextmanager
def reported(progress: Progress | None) -> Iterator[None]:
    """Context in which each line of progress, from any thread, is passed to ``progress``, one line at a time.

    Raises InputError unless ``progress`` is callable or None.
    """
    if progress is None:
        yield
        return
    if not callable(progress):
        raise InputError("progress", said(progress), "a function that takes a line, such as print, or None")
    log = logging.getLogger("fem_reference")
    handler, level = _Calling(progress), log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)


class _Calling(logging.Handler):
    """Logging handler that calls a function with each line."""

    def __init__(self, progress: Progress) -> None:
        super().__init__()
        self.progress = progress

    def emit(self, record: logging.LogRecord) -> None:
        self.progress(record.getMessage())
