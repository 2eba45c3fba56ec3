"""A reference and its candidates, measured and judged: what reports are written from."""

from dataclasses import dataclass

from fem_reference.judge import Verdict, Word, overall, verdict
from fem_reference.metrics import Measure, Yardstick, at_rest, measure
from fem_reference.problem import Setup
from fem_reference.runs import Run
from fem_reference.scene import Scene


@dataclass(frozen=True, eq=False)
class Comparison:
    """``deviations``: by candidate name, its measures against the reference. ``changes``: by run name (``"reference"`` among
    them), its measures against the rest state. ``extension_error`` [mm]: by frame, the greatest error over the fibres that the
    extension makes on the reference's own surface."""

    scene: Scene
    setup: Setup
    reference: Run
    candidates: tuple[Run, ...]
    yardstick: Yardstick
    deviations: dict[str, tuple[Measure, ...]]
    changes: dict[str, tuple[Measure, ...]]
    extension_error: Measure
    verdicts: tuple[Verdict, ...]

    @property
    def word(self) -> Word:
        """The verdict of the case."""
        return overall(verdict.word for verdict in self.verdicts)
