"""Signals that end the process, as the command hears them, and one whose exception Python loses."""

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from fem_reference.foundations import signals


@contextmanager
def listening() -> Iterator[None]:
    """A context in which signals are heard as by the command."""
    before, hook = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}, sys.unraisablehook
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background it is ignored
        signals.listen()
        yield
    finally:
        for number in before:
            signal.signal(number, signal.SIG_IGN)
        time.sleep(0.1)  # a repeated signal that is on its way would end the tests
        for number, handler in before.items():
            signal.signal(number, handler)
        sys.unraisablehook = hook


class Losing:
    """Receives a signal where Python loses exceptions: while it is deleted."""

    def __init__(self, number: int) -> None:
        self.number = number

    def __del__(self) -> None:
        signal.raise_signal(self.number)
