"""The reference of a muscle with its states, which stress and pressure follow from."""

from fem_reference.foundations.errors import InputError
from fem_reference.report.words import duration
from fem_reference.runs import states
from fem_reference.runs.store import Run
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.execution import Bench


def reference(bench: Bench[MuscleCase], *, again: bool) -> Run:
    """The reference with its states, where its solver has any; InputError where it was solved without them and is not to be solved
    ``again``.
    """
    choice = bench.scene.reference
    if not hasattr(bench.settings(choice, "reference"), "store_state"):
        return bench.obtain("reference", choice, "reference")
    known = bench.known("reference", choice.model_copy(update={"store_state": None}), "reference")
    folder = known.folder if known else None
    if known and folder and not again and not states.are_kept(folder, known.numbers):
        took = duration(known.outcome.cost.get("seconds"))
        got = f"a reference that was solved before without its states ({folder}), which stress and pressure follow from"
        raise InputError("export", got, f"--solve, which solves it again (that took {took})")
    return bench.obtain("reference", choice.model_copy(update={"store_state": True}), "reference")
