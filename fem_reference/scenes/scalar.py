"""Frozen records of a scalar case: the domain of its field, its boundary conditions and its elements."""

from functools import partial
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from fem_reference.effects import FieldEffect
from fem_reference.foundations.formula import Formula
from fem_reference.foundations.records import Record, increasing, one_of, rule
from fem_reference.scenes.case import Case, Standard

_Nodes = Annotated[
    tuple[float, ...], Field(min_length=2), AfterValidator(partial(increasing, want="nodes in increasing order"))
]


class Interval(Record):
    """An interval with ``count`` nodes from ``start`` to ``end``, both included. The inner nodes are evenly spaced or, with a
    ``seed`` for random numbers, at random positions.
    """

    start: float
    end: float
    count: int = Field(ge=2, le=1_000_000)
    seed: int | None = Field(default=None, ge=0)

    _check = rule(lambda one: one.end > one.start, "an end beyond the start")


class MeshFiles(Record):
    """Triangles in the format of listing 4.5 of the report DCSE/TR-2022-03: comma-separated files without a header.

    ``points``: a file with a row of 2 or 3 coordinates for each vertex. ``triangles``: a file with a row of three vertex numbers,
    counted from 1, for each triangle; or the word ``delaunay`` for a Delaunay triangulation of points in the plane.
    """

    points: str
    triangles: str


class SurfaceFile(Record):
    """A triangle surface in a mesh ``file``, whose coordinates are multiplied by ``scale``."""

    file: str
    scale: float = Field(gt=0)


class Domain(Record):
    """The domain of the field: exactly one of ``interval``, ``nodes`` (increasing coordinates), ``mesh`` and ``surface``."""

    interval: Interval | None = None
    nodes: _Nodes | None = None
    mesh: MeshFiles | None = None
    surface: SurfaceFile | None = None

    _check = one_of("interval", "nodes", "mesh", "surface")


class Boundary(Record):
    """A boundary condition, in one of two forms. On parts of the boundary without a condition, the slope of the field is 0.

    The first form has the key ``on``: an end of an interval, or the ``rim`` (the boundary) of a triangle mesh. It prescribes the
    ``value`` of the field (Dirichlet) or its ``slope`` along the outward normal (Neumann). A formula ``where`` limits the condition
    to facets on which the formula is positive at every vertex.

    The second form has the key ``bounds`` alone: a file in the format of listing 4.5 of the report DCSE/TR-2022-03, with a row of
    vertex numbers, counted from 1, and a row of the values that are prescribed at these vertices.
    """

    on: Literal["left", "right", "rim"] | None = None
    where: Formula | None = None
    value: Formula | None = None
    slope: Formula | None = None
    bounds: str | None = None

    _check_form = one_of("on", "bounds")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.bounds is not None and (self.where, self.value, self.slope) != (None, None, None):
            raise ValueError('"bounds" alone, as its file states vertices and values')
        if self.on is not None and (self.value is None) == (self.slope is None):
            raise ValueError('exactly one of "value" and "slope"')
        return self


class Element(Record):
    """Lagrange elements of ``order`` 1 or 2. ``form``: ``galerkin``, without stabilisation; ``supg``, stabilised along the flow; or
    ``auto``, which means ``supg`` if the mesh Peclet number is above 1 anywhere, and ``galerkin`` otherwise.
    """

    order: Literal[1, 2]
    form: Literal["auto", "galerkin", "supg"]


class ScalarCase(Case):
    """The case of a scalar field. ``effect``: a table for each effect, with its ``name`` and its parameters. ``exact``: the exact
    solution, if it is known. ``quick``: new values by key, for a faster and less accurate solution. ``unsolved``: the reason, if
    the reference does not solve the case.
    """

    domain: Domain
    boundary: tuple[Boundary, ...] = ()
    element: Element
    exact: Formula | None = None

    task = "solve_field"
    carries = frozenset({"field"})
    determined_by = frozenset({"domain", "boundary", "element"})
    naming_files = frozenset({"points", "triangles", "file", "bounds"})

    @property
    def effects(self) -> tuple[FieldEffect, ...]:
        """The effects, in the order of the file."""
        return self.effect

    @property
    def numbers(self) -> tuple[int, ...]:
        """The frame number of a steady field, which has only one frame."""
        return (0,)

    def standards(self, of: str) -> frozenset[Standard]:
        """The standards as in ``Case.standards``, and the exact solution if known; the rest state is no standard of a field."""
        found: set[Standard] = {"itself"}
        if self.exact is not None:
            found.add("exact")
        if of != "reference":
            found.add("reference")
        return frozenset(found)

    @property
    def facts(self) -> dict[str, str]:
        """A summary of the case in words, by heading."""
        (kind,) = (name for name, given in self.domain if given is not None)
        return {
            "domain": kind,
            "element": f"Lagrange of order {self.element.order}, {self.element.form}",
            "exact solution": self.exact or "not known",
        }
