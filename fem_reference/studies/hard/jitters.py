"""The same end whatever the mesh: the reference on a hard case time and again, on meshes that are a little different at random."""

import time
from collections import Counter
from collections.abc import Callable

import numpy as np

from fem_reference.assessment.health import Followed
from fem_reference.foundations.errors import InputError
from fem_reference.geometry.embedding import Locator
from fem_reference.runs.store import Outcome
from fem_reference.scenes import casefile
from fem_reference.studies.hard.records import Hard
from fem_reference.studies.hard.steps import SameEnd

MOVED = 0.1  # of a cell of a block, by which its points are moved at most
SIZES = 0.03  # of the size of the tetrahedra of a shipped case, by which it differs at most
LONGEST = 60.0  # [s] of processor time of a run that is repeated

Solve = Callable[[Hard], tuple[Outcome, Followed]]


def jittered(hard: Hard, number: int) -> Hard:
    """The case on the mesh of a ``number``, the same each time."""
    if hard.block is not None:
        jitter = max(hard.block.jitter, MOVED)
        return hard.model_copy(update={"block": hard.block.model_copy(update={"jitter": jitter, "seed": number})})
    shipped = hard.shipped
    assert shipped is not None  # a Hard record has one of the two
    size = casefile.muscle(shipped.read()).muscle.tet_size
    share = 1 + SIZES * np.random.default_rng(number).uniform(-1, 1)
    changed = shipped.changes | {"muscle.tet_size": f"{share * float(size)!r} mm"}
    return hard.model_copy(update={"shipped": shipped.model_copy(update={"changes": changed})})


def compare(hard: Hard, first: tuple[Outcome, Followed], count: int, solve: Solve) -> SameEnd:
    """Compare ``count`` runs of a case on other meshes with the ``first``: all alike converged or not, and the greatest distance
    over frames, in per cent of the body's size; at points of the same material.
    """
    begin, elsewhere, outcome, followed = time.process_time(), 0.0, *first
    ended, off, reached = Counter[str](), list[float](), list[int]()
    for number in range(1, count + 1):
        try:
            other, found = solve(jittered(hard, number))
        except InputError as error:
            if not ended:
                return SameEnd(True, f"no jitters: {error}")
            ended["refused"] += 1
            continue
        ended[other.status] += 1
        elsewhere += other.cost.get("seconds_processor", 0.0)
        reached.append(found.numbers[-1])
        off.append(_apart(followed, found))
        if time.process_time() - begin + elsewhere > LONGEST * number:
            return SameEnd(True, f"no jitters, of which one takes more than {LONGEST:g} s")
    words = ", ".join(f"{many} {status}" for status, many in ended.most_common())
    if off:
        words += f", up to frame {min(reached)}" + (f" to {max(reached)}" if min(reached) < max(reached) else "")
        words += f", apart by {max(off):.2g} % at most, {np.median(off):.2g} % in the median"
    statuses = set(ended) - {"refused"}
    alike = statuses <= {"converged"} if outcome.status == "converged" else "converged" not in statuses
    return SameEnd(alike, f"jitters: {words}")


def _apart(one: Followed, other: Followed) -> float:
    """The greatest distance of two runs over the frames of both [% of the body's size]."""
    both = min(len(one.numbers), len(other.numbers))
    moved = other.positions[:both]
    if other.mesh is not None and other.nodes is not None:
        at = Locator(other.mesh).embed(one.surface.points)
        moved = np.array([at.interpolate(other.mesh, nodes) for nodes in other.nodes[:both]])
    return 100 * float(np.linalg.norm(one.positions[:both] - moved, axis=2).max()) / one.size
