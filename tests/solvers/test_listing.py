"""The listings as a solver: conditions that they have no place for are refused, and all else is theirs whatever the case says."""

import fields
import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.problems.scalar import FieldProblem, build
from fem_reference.solvers import listing, listing_kernels

ENDS = ({"on": "left", "value": 0}, {"on": "right", "slope": "-1"})


def rod(folder, *boundary) -> FieldProblem:
    """A rod with the conditions of listing 4.1, or with others."""
    return build(
        fields.scene(
            folder,
            domain={"interval": {"start": 0.0, "end": 1.0, "count": 7, "seed": 1}},
            effect=[{"name": "diffusion", "coefficient": 0.7}],
            boundary=list(boundary or ENDS),
        )
    )


@pytest.mark.parametrize("peclet", [None, 2.0])
def test_the_rod_is_that_of_the_listing(tmp_path, peclet) -> None:
    given, (offer,) = rod(tmp_path), listing.SOLVES
    found = offer.run(given, listing.ListingSettings(peclet=peclet))
    assert np.array_equal(found.values[0], listing_kernels.fem1d(given.mesh.points[:, 0], peclet or 1.0))


def test_other_conditions_than_the_listing_has_are_refused(tmp_path) -> None:
    (offer,) = listing.SOLVES
    other = rod(tmp_path, {"on": "left", "value": 0}, {"on": "right", "value": 1})
    with pytest.raises(InputError, match="boundary: got other conditions, want value 0 on the left and slope -1"):
        offer.run(other, listing.ListingSettings())
