"""The lab of the catalogue limits how long a body may take, and no number comes of a process that died."""

import pytest

from fem_reference.runs.store import Outcome, collected
from fem_reference.verification.lab import FemLab


def test_a_body_of_the_catalogue_has_a_time_limit() -> None:
    class Noted:
        def solve(self, _, settings):
            return collected((), Outcome("diverged", f"{settings.time_limit:g}"))

    lab = FemLab(Noted())
    assert lab.solve(None, "P2/P1").outcome.message == "1800"
    assert lab.solve(None, "P2/P1", time_limit="5 s").outcome.message == "5"


@pytest.mark.parametrize("status", ["crashed", "timed out", "stalled"])
def test_a_process_that_is_ended_measures_nothing(status) -> None:
    """Entries that count how a run ends would take its death for an end of the physics."""

    class Dead:
        def solve(self, *_):
            return collected((), Outcome(status, "the FEniCSx process ended with exit status -2"))

    with pytest.raises(RuntimeError, match="ended with exit status -2"):
        FemLab(Dead()).solve(None, "P2/P1")
