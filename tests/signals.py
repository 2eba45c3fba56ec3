"""Signals that end the process, as the command hears them, and one whose exception Python loses."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from fem_reference.foundations import signals


@contextmanager
def listening() -> Iterator[None]:
    """A context in which signals are heard as by the command."""
    before, hook = signal.getsignal(signal.SIGTERM), sys.unraisablehook
    try:
        signals.listen()
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
        sys.unraisablehook = hook


class Losing:
    """Receives a signal where Python loses exceptions: while it is deleted."""

    def __init__(self, number: int) -> None:
        self.number = number

    def __del__(self) -> None:
        signal.raise_signal(self.number)
