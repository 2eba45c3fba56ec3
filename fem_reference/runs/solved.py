"""Names that runs of bodies had."""

from fem_reference.runs.store import Frame as Reached
from fem_reference.runs.store import Run as Solved

__all__ = ["Reached", "Solved"]
