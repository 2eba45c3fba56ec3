"""An unstable equilibrium is left where that is wanted."""

import numpy as np
import pytest

from fem_reference.solvers.fenicsx import BodySettings
from tests.solvers.fenicsx.test_stability import THIN, column, critical, flesh, session  # noqa: F401 - a fixture

pytestmark = pytest.mark.slow


def test_a_column_leaves_the_straight_state_where_it_is_unstable(session) -> None:  # noqa: F811
    body = column("Q2/Q1", (1, 1, 10), [0.97 * critical(THIN), 1.1 * critical(THIN)])
    straight, bent = (
        session.solve(body, BodySettings(element="Q2/Q1", first_step=100.0, follow=follow))
        for follow in ("equilibrium", "stable")
    )
    assert [state.scalars["negative_modes"] for state in straight.states] == [0, 0, 1]
    assert [state.scalars["negative_modes"] for state in bent.states] == [0, 0, 0]
    assert bent.last.scalars["energy"] < straight.last.scalars["energy"]
    aside = [np.ptp(solved.last.points[:, 0]) for solved in (straight, bent)]
    assert aside[1] > 1.2 * aside[0]
    assert (
        "in 1 of them an unstable equilibrium was left along its lowest mode, first at frame 2" in bent.outcome.message
    )
    assert "unstable" in straight.outcome.message
