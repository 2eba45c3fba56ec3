"""What a solver of scalar problems answers with."""

from dataclasses import dataclass

from fem_reference.foundations.mesh import Floats
from fem_reference.runs.store import Outcome


@dataclass(frozen=True, eq=False)
class Solution:
    """``values`` (N,) of the field at the nodes (the vertices, then for order 2 the middles of ``mesh.edges``), and how it ended.

    ``components`` (n, d): the vector that the values are the norm of, where a solver computes one. After a failure the values are
    not-a-number. ``form``: the weak form that was solved, None where it is the problem's own.
    """

    values: Floats
    outcome: Outcome
    components: Floats | None = None
    form: str | None = None
