"""Comparisons for cases of several muscles: the reference solves all muscles together, and candidates solve each muscle alone."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_reference.assessment import neighbours
from fem_reference.assessment.comparison import Comparison
from fem_reference.foundations.errors import InputError
from fem_reference.runs.store import Run, complete
from fem_reference.runs.views import beside
from fem_reference.scenes.case import Candidate, Case
from fem_reference.studies import judging, muscle_bars
from fem_reference.studies.execution import Bench

# A remark on candidates, for pages about several muscles.
ALONE = "Each candidate solves each muscle by itself, without the other muscles."


@dataclass(frozen=True, eq=False)
class ByMuscle:
    """Comparisons of the ``muscles`` of a case, by name of the muscle.

    Each row of ``worst`` contains a solver, the names of two muscles, the maximum depth [mm] to which the solver lets them overlap,
    and the frame of the maximum. ``lacking``: pairs of a candidate and a muscle for which the candidate has no frames.
    """

    muscles: dict[str, Comparison]
    worst: tuple[tuple[str, str, str, float, int], ...]
    lacking: tuple[tuple[str, str], ...]

    @property
    def penetration(self) -> list[dict[str, object]]:
        """The rows of ``worst`` as dictionaries."""
        names = ("solver", "muscle", "other", "depth_mm", "frame")
        return [dict(zip(names, row, strict=True)) for row in self.worst]


def compared(bench: Bench[Case], chosen: Sequence[tuple[Candidate, str]], *, error_bars: bool = False) -> ByMuscle:
    """Compare each muscle's part of the common reference with the candidates that solve this muscle alone.

    Recorded frames are read from folders named after the muscles; a candidate may lack frames of some muscles. With ``error_bars``,
    error bars are computed; otherwise only stored ones are used.
    """
    parts, found = bench.parts, dict[str, Comparison]()
    chosen = [(bench.found(*one), one[1]) for one in chosen]
    own = {name: [_own(one, name) for one in chosen] for name in parts}
    for i, (entry, place) in enumerate(chosen):
        if all(given[i] is None for given in own.values()):
            want = f"folders {' or '.join(parts)} in it, with the frames of these muscles"
            raise InputError(place, f'"{entry.settings["folder"]}" without frames of a muscle', want)
    reference, numbers = bench.reference(), bench.scene.numbers
    bars = (muscle_bars.obtain if error_bars else muscle_bars.stored)(bench, reference)
    runs = {"reference": split(bench, reference)}
    for name, part in parts.items():
        for entry, place in filter(None, own[name]):
            run = part.obtain(entry.name, entry, place)
            runs.setdefault(run.name, {})[name] = complete(run, numbers)
    runs = {who: beside(some) for who, some in runs.items()}
    for name, part in parts.items():
        solved = [some[name] for some in runs.values() if name in some]
        found[name] = judging.compare(part, solved[0], solved[1:], bars.get(name))
    lacking = tuple((entry.name, name) for i, (entry, _) in enumerate(chosen) for name in parts if own[name][i] is None)
    worst = list[tuple[str, str, str, float, int]]()
    for who, some in runs.items():
        for one, other, depth in neighbours.depths(some):
            at = int(np.nanargmax(depth)) if np.isfinite(depth).any() else 0
            worst.append((who, one, other, float(depth[at]), some[one].numbers[at]))
    return ByMuscle(found, tuple(worst), lacking)


def split(bench: Bench[Case], reference: Run) -> dict[str, Run]:
    """Split the ``reference`` of all muscles into a run for each muscle, by name. Each run covers all frames, and has the other
    runs as ``others``.
    """
    numbers = bench.scene.numbers
    return beside({name: complete(run, numbers) for name, run in bench.by_muscle(reference).items()})


def of_part(entry: Candidate, place: str, muscle: str) -> Candidate:
    """The candidate ``entry`` for one ``muscle``: recorded frames are read from the folder of this muscle. Raises InputError at
    ``place`` if there is no such folder.
    """
    found = _own((entry, place), muscle)
    if found is None:
        want = f'a folder "{muscle}" in it, with the frames of this muscle'
        raise InputError(place, f'"{entry.settings["folder"]}" without frames of the muscle', want)
    return found[0]


def _own(chosen: tuple[Candidate, str], name: str) -> tuple[Candidate, str] | None:
    """A candidate and its place, for the muscle ``name``. Recorded frames are those in the folder of this muscle; None if there is
    no such folder.
    """
    entry, place = chosen
    if entry.solver != "recorded":
        return chosen
    folder = Path(entry.settings["folder"]) / name
    return (entry.model_copy(update={"folder": str(folder)}), place) if folder.exists() else None
