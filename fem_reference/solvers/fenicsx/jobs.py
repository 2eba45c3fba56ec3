"""Messages between the caller and the process that solves: jobs and frames."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import Body
from fem_reference.runs.states import NodalState
from fem_reference.solvers.fenicsx.settings import BodySettings


@dataclass(frozen=True, eq=False)
class Job:
    """A ``body`` and how to solve it; ``samples``: by name, the cell (n,) of each point and the points (n, 3) at rest whose
    positions are wanted. Of a muscle there are some; then forces at edges that its attachments share are divided between them.
    """

    body: Body
    settings: BodySettings
    samples: dict[str, tuple[Ints, Floats]]


def stored_state(arrays: Mapping[str, Any]) -> NodalState | None:
    """The unknowns of the cells among the ``arrays`` of a frame, None where they were not asked for."""
    own = {name.removeprefix("state "): arrays[name] for name in arrays if name.startswith("state ")}
    return NodalState.of(own) if own else None
