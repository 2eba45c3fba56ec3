"""The lab of the catalogue limits how long a body may take."""

from fem_reference.runs.store import Outcome, collected
from fem_reference.verification.lab import FemLab


def test_a_body_of_the_catalogue_has_a_time_limit() -> None:
    class Noted:
        def solve(self, _, settings):
            return collected((), Outcome("timed out", f"{settings.time_limit:g}"))

    lab = FemLab(Noted())
    assert lab.solve(None, "P2/P1").outcome.message == "1800"
    assert lab.solve(None, "P2/P1", time_limit="5 s").outcome.message == "5"
