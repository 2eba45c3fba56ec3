"""The listings as a solver: what they have no place for is refused, and the rest is theirs whatever the case says."""

from types import SimpleNamespace

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.solvers import listing, listing_kernels

NODES = np.array([0.0, 0.3, 0.4, 1.0])


def rod(**changes) -> SimpleNamespace:
    """The rod of listing 4.1, as far as the solver looks at a problem."""
    cells = np.column_stack([np.arange(3), np.arange(1, 4)])
    mesh = SimpleNamespace(points=NODES[:, None], cells=cells, edges=cells)
    flux = SimpleNamespace(slope="-1", facets=np.array([[3]]))
    given = {"mesh": mesh, "order": 1, "fixed": np.array([0.0, np.nan, np.nan, np.nan]), "fluxes": (flux,)}
    return SimpleNamespace(**given | changes)


@pytest.mark.parametrize("peclet", [None, 2.0])
def test_the_rod_is_that_of_the_listing(peclet) -> None:
    found = listing.solve_field(rod(), listing.ListingSettings(peclet=peclet))
    assert np.array_equal(found.values, listing_kernels.fem1d(NODES, peclet or 1.0))


def test_other_conditions_than_the_listing_has_are_refused() -> None:
    with pytest.raises(InputError, match="boundary: got other conditions, want value 0 on the left and slope -1"):
        listing.solve_field(rod(fluxes=()), listing.ListingSettings())
