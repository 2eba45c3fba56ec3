"""Checks of the fibre directions of a body, and of the normals about which laws rotate them."""

import math

import numpy as np

from fem_reference.effects.holzapfel_ogden import HolzapfelOgden
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, place_of
from fem_reference.geometry.fibres import Directions
from fem_reference.problems.body import Body

_UNIT = 1e-6  # the tolerance on the length of a unit vector
_LEAST = 1.0  # the minimum angle [deg] between a normal and the fibres, whose directions in a mesh are not exact


def check_unit(fibre: Directions, places: Floats) -> None:
    """Raise InputError unless the directions at ``places`` (n, 3) [mm], one in each cell, are unit vectors."""
    cells = np.arange(len(places))
    try:
        found = np.asarray(fibre(cells, places), float)
    except Exception as error:  # any error in a function of the caller
        raise InputError("fibre", f"{type(error).__name__}: {error}", "directions (n, 3) at points (n, 3)") from error
    if found.shape != (len(cells), 3):
        raise InputError("fibre", f"directions {found.shape} at points {(len(cells), 3)}", "one direction (3,) at each")
    lengths = np.linalg.norm(found, axis=1)
    worst = int(np.argmax(np.where(np.isfinite(lengths), np.abs(lengths - 1), np.inf)))
    if not abs(lengths[worst] - 1) <= _UNIT:
        raise InputError("fibre", f"a direction of length {lengths[worst]:.6g} in cell {worst}", "unit vectors")


def check_normals(body: Body) -> None:
    """Raise InputError if the ``normal`` of a law is along the fibres, so that no direction perpendicular to both is defined."""
    laws = [effect for effect in body.effects if isinstance(effect, HolzapfelOgden)]
    fibre = body.fibre
    if fibre is None or not laws:
        return
    for places in body.mesh.places():
        fibres = fibre(np.arange(len(places)), places)
        for law in laws:
            across = np.linalg.norm(np.cross(law.normal, fibres), axis=1) / math.hypot(*law.normal)
            worst = int(np.argmin(across))
            if not across[worst] >= math.sin(math.radians(_LEAST)):
                got = f"a direction {math.degrees(across[worst]):.2g} deg from the fibre at {place_of(places[worst])}"
                raise InputError(f"effect {law.title}.normal", got, f"at least {_LEAST:g} deg, preferably 30 deg")
