"""Parts of entries: true values, negative controls, materials, constraints, and readings from the states of a body.

The true values are in ``validation/``: closed forms and published numbers, which import nothing from this package.
"""

import importlib
import importlib.util
import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from fem_reference.effects import Effect, make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems.body import ELEMENTS, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.scenes.case import HOME

TRUTHS = HOME / "validation"
SURFACE = ("x0", "x1", "y0", "y1", "z0", "z1")  # of a box
SLOW: dict[str, Any] = {"slow": True, "slow_negative_control": True}  # of an entry
NO_GRADIENT = ((0.0, 0.0, 0.0),) * 3


def find(name: str) -> ModuleType:
    """The module ``validation/<name>.py``, even if ``validation`` is not on Python's search path.

    >>> round(find("torsion").square_bar_stiffness(1.0, 1.0), 4)
    0.1406
    """
    if TRUTHS.name not in sys.modules:
        places, file = [str(TRUTHS)], TRUTHS / "__init__.py"
        spec = importlib.util.spec_from_file_location(TRUTHS.name, file, submodule_search_locations=places)
        assert spec is not None  # a file that ends in .py always has one
        assert spec.loader is not None
        sys.modules[TRUTHS.name] = package = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(package)
    loaded = [str(Path(path).resolve()) for path in sys.modules[TRUTHS.name].__path__]
    if str(TRUTHS) not in loaded:
        raise ImportError(f'another package "{TRUTHS.name}" is loaded, from {loaded}; the truths are in {TRUTHS}')
    return importlib.import_module(f"{TRUTHS.name}.{name}")


def control(words: str, **wrong: object) -> dict[str, Any]:
    """The negative control of an entry: a deliberate mistake, described in ``words``, and the ``wrong`` values that cause it."""
    return {"negative_control": words, "wrong": wrong}


def ramp(full: float = 1.0) -> list[dict[str, float]]:
    """A ramp from 0 at frame 0 to ``full`` at frame 1, as scene files write it."""
    return [{"frame": 0.0, "amount": 0.0}, {"frame": 1.0, "amount": full}]


def clamped(*regions: str, components: tuple[int, ...] = (0, 1, 2)) -> tuple[Prescribed, ...]:
    """Regions whose displacements along the axes ``components`` are zero."""
    return tuple(Prescribed(region, region, components, Rest()) for region in regions)


def sliding(*faces: str) -> tuple[Prescribed, ...]:
    """Faces such as ``x0`` that slide in their planes without friction."""
    return tuple(Prescribed(face, face, ("xyz".index(face[0]),), Rest()) for face in faces)


# The planes of symmetry: the coordinate planes through the origin.
SYMMETRY = sliding("x0", "y0", "z0")


def resistance(element: str, bulk: float) -> Effect:
    """The effect that resists volume change with the modulus ``bulk`` [MPa], for an ``element``."""
    name = "incompressible_penalty" if ELEMENTS[element][2] is None else "incompressible"
    return make(name, bulk=f"{bulk} MPa")


def neo_hooke(mu: float, bulk: float, element: str = "P2/P1") -> tuple[Effect, ...]:
    """Neo-Hookean material with the moduli ``mu`` and ``bulk`` [MPa], for an ``element``."""
    return make("neo_hooke", mu=f"{mu} MPa"), resistance(element, bulk)


def mooney_rivlin(c1: float, c2: float, bulk: float) -> tuple[Effect, ...]:
    """Mooney-Rivlin material with ``c1``, ``c2`` and ``bulk`` [MPa], for elements with a pressure."""
    return make("mooney_rivlin", c1=f"{c1} MPa", c2=f"{c2} MPa"), resistance("P2/P1", bulk)


def frames(last: float, count: int) -> tuple[float, ...]:
    """Frame 0 and ``count`` evenly spaced frames after it, up to ``last``."""
    return tuple(np.linspace(0, last, count + 1).tolist())


def farthest(points: Floats, others: Floats) -> float:
    """The largest distance [mm] between corresponding ``points`` (n, 3) and ``others`` (n, 3)."""
    return float(np.linalg.norm(points - others, axis=1).max())


def nearest(points: Floats, place: Iterable[float]) -> int:
    """The index of the point in ``points`` (n, 3) that is nearest to the position ``place`` (3,)."""
    return int(np.argmin(np.linalg.norm(points - np.array(tuple(place)), axis=1)))
