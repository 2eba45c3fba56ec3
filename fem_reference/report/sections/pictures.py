"""The runs in pictures, each at its worst frame."""

from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.report import gallery


def facts(comparison: Comparison) -> dict[str, Any]:
    """The pictures, or what is missing."""
    wanted = gallery.shots(comparison)
    figures, missing = gallery.figures(comparison.setup, comparison.reference.surface, wanted)
    return {"figures": figures, "missing": missing, "ticks": gallery.ticks}
