"""The package's lines of progress, passed to a function of the caller."""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.given import said

Progress = Callable[[str], object]


@contextmanager
def reported(progress: Progress | None) -> Iterator[None]:
    """A context in which each line of progress goes to ``progress``, one at a time, from any thread; InputError unless it is
    callable or None.
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
    """Calls a function with each line."""

    def __init__(self, progress: Progress) -> None:
        super().__init__()
        self.progress = progress

    def emit(self, record: logging.LogRecord) -> None:
        self.progress(record.getMessage())
