"""How FEniCSx compiles what it solves: patiently where another process compiles the same, and past what one left half-done."""

import signal
import time
from pathlib import Path
from types import FrameType
from typing import Any

from dolfinx import fem, jit

PATIENCE = 300  # [s] that a process waits for another's compilation
OPTIONS = {"timeout": PATIENCE}


def form(expression: Any, entity_maps: Any = None) -> Any:
    """A compiled form; ``entity_maps``: how meshes that meet in it lie in each other."""
    return fem.form(expression, jit_options=OPTIONS, entity_maps=entity_maps)


def expression(value: Any, points: Any) -> Any:
    """A compiled expression at reference ``points`` (q, 3)."""
    return fem.Expression(value, points, jit_options=OPTIONS)


def prepare() -> None:
    """Make an interrupted compilation clean up after itself, and clean up after processes that could not: what they left half-done
    others would wait for.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # ours to end is the parent's business
    signal.signal(signal.SIGTERM, _stop)
    folder = Path(jit.get_options()["cache_dir"])
    for source in folder.glob("*.c") if folder.is_dir() else ():
        done = source.with_suffix(".c.cached").exists()
        if not done and time.time() - source.stat().st_mtime > PATIENCE:
            source.unlink(missing_ok=True)


def _stop(_number: int, _frame: FrameType | None) -> None:
    # FFCx cleans up after an Exception, which SystemExit is not.
    raise RuntimeError("told to stop")
