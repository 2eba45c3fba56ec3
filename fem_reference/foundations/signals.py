"""Signals that end this process, and the exceptions that they raise."""

import os
import signal
import sys
import threading
from contextlib import suppress

TERMINATED = 143  # the status that shells report after SIGTERM
_RAISED = {KeyboardInterrupt: signal.SIGINT, SystemExit: signal.SIGTERM}
# The time [s] after which a signal is sent again if its exception was lost.
_AGAIN = 0.05


def listen() -> None:
    """Make SIGTERM raise SystemExit, as SIGINT raises KeyboardInterrupt, so that running work is cleaned up.

    If Python discards the exception, as it does in a callback or in ``__del__``, the signal is sent again.
    """
    before = sys.unraisablehook

    def lost(found: "sys.UnraisableHookArgs") -> None:
        if found.exc_type in _RAISED and getattr(found.exc_value, "code", TERMINATED) == TERMINATED:
            with suppress(RuntimeError):  # the interpreter is shutting down
                threading.Timer(_AGAIN, os.kill, (os.getpid(), _RAISED[found.exc_type])).start()
        else:
            before(found)

    sys.unraisablehook = lost
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(TERMINATED))
