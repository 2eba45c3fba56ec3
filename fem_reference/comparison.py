"""A reference and its candidates, measured and judged: what reports are written from."""

from dataclasses import dataclass

from fem_reference.errors import InputError
from fem_reference.judge import Verdict, Word, overall, verdict
from fem_reference.metrics import Measure, Yardstick, at_rest, measure
from fem_reference.metrics.fibre_length import extension_error
from fem_reference.problem import Setup
from fem_reference.runs import Run
from fem_reference.scene import Scene


@dataclass(frozen=True, eq=False)
class Comparison:
    """``deviations``: by candidate name, its measures against the reference. ``changes``: by run name (``"reference"`` among
    them), its measures against the rest state. ``extension_error`` [mm]: by frame, the greatest error over the fibres that the
    extension makes on the reference's own surface.
    """

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


def compare(scene: Scene, setup: Setup, reference: Run, candidates: tuple[Run, ...]) -> Comparison:
    """Measure and judge runs that all have the frames of the scene (``not a number`` where a run did not reach one)."""
    if reference.fibres is None:
        raise InputError(
            f"{reference.name}: fibres", "a run without an interior", "a reference that carries the fibres"
        )
    yardstick = Yardstick.of(reference, reference.fibres)
    deviations = {run.name: measure(run, reference, yardstick) for run in candidates}
    changes = {run.name: measure(run, at_rest(run), yardstick) for run in (reference, *candidates)}
    measured = {"reference": changes["reference"]} | deviations
    verdicts = tuple(
        verdict(expectation.model_copy(update={"of": name}), measured[name], reference.numbers)
        for expectation in scene.expect
        for name in (deviations if expectation.of == "candidates" else [expectation.of])
        if name in measured
    )
    error = extension_error(reference, yardstick)
    return Comparison(scene, setup, reference, candidates, yardstick, deviations, changes, error, verdicts)
