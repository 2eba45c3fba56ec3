"""The weak form of a body, summed from its effects. Parameters are symbols, so that one compiled form serves many bodies."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import compress, pairwise
from operator import not_
from typing import Any, NamedTuple

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl.algorithms.analysis import extract_type
from ufl.classes import Label

from fem_reference.effects import Effect, Energy, Load, Ramped, State, elastic_state, regions_named, total_energy
from fem_reference.foundations.material_point import Functions
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.regions import INWARDS
from fem_reference.problems.body import Body, reference_nodes
from fem_reference.solvers.fenicsx import compiling, meshes
from fem_reference.solvers.fenicsx.meshes import DEGREE, geometry, rule
from fem_reference.solvers.fenicsx.rest_stress import rest_stress
from fem_reference.solvers.fenicsx.settings import BodySettings

Rule = tuple[Floats, Floats]


def _above(x: Any, limit: Any, then: Any, otherwise: Any) -> Any:
    return ufl.conditional(ufl.gt(x, limit), then, otherwise)


_FUNCTIONS = Functions(ufl.exp, ufl.ln, ufl.sqrt, ufl.cos, ufl.sin, _above)


class Derivatives(NamedTuple):
    """Two compiled expressions at the quadrature points, in the order of ``cells.c``: ``first``, the first derivatives of an
    energy; ``second``, these followed by the upper triangle of the second derivatives.
    """

    first: Any
    second: Any


class Form:
    """The weak form of a body.

    ``derivatives``: the derivatives of the energy, with ``kinds`` variables for each component of the displacement. An effect whose
    amount is zero from one frame to the next is left out between these frames. ``loads``: the residual of loads on the surface;
    ``stretched``: the residual of effects that store energy on the surface; both are 0 without such effects.

    ``energy``: the stored energy as an integral; ``kinetic``: the kinetic energy (0 without inertia); ``determinant``: det F;
    ``fibre_stretch``: as the energies use it (None without fibres); ``rule``: points (q, 3) and weights (q,) of the quadrature of
    ``degree``; ``regions``: this rank's facets by name; ``rest``: the stress at rest of a body in situ. The caller sets the amounts
    of effects (``set_amounts``) and the time ``step`` (None if nothing depends on it).
    """

    def __init__(self, msh: mesh.Mesh, body: Body, unknowns: fem.Function, settings: BodySettings, cells: Ints) -> None:
        """``cells``: the index in the body of each cell of this rank."""
        self.mesh, self.unknowns, self.element = msh, unknowns, settings.element
        self.regions = dict(zip(body.mesh.facets, meshes.local_facets(msh, body.mesh.facets.values()), strict=True))
        self.rule = rule(settings.element, settings.quadrature_degree)
        self.degree = settings.quadrature_degree or DEGREE[settings.element]
        points, weights = self.rule
        inside = {"quadrature_rule": "custom", "quadrature_points": points, "quadrature_weights": weights}
        self.dx = ufl.Measure("dx", domain=msh, metadata={"quadrature_degree": self.degree} | inside)
        self.ds = meshes.facet_measure(msh, self.regions.values(), self.degree)
        self.effects, self.amounts = body.effects, [fem.Constant(msh, 1.0) for _ in body.effects]
        effects = [_symbolic(effect, msh) for effect in body.effects]
        acting = list(zip(effects, self.amounts, strict=True))
        self.step = _step(effects, unknowns.function_space)
        state, variables = _state(unknowns, self._fibre(body, cells), self.step)
        state = replace(state, regions=self._regions(body, cells))
        self.determinant = state.J
        self.fibre_stretch = None if state.fibre is None else elastic_state(acting, state).fibre_stretch
        self.rest = rest_stress(unknowns, body.effects)
        at_rest = 0 if self.rest is None else self.rest.energy(state)
        stored = [(effect, amount) for effect, amount in acting if not isinstance(effect, Energy) or effect.stored]
        stretched = self._stretched(acting, body, state)
        self.energy = (total_energy(stored, state) + at_rest) * self.dx + stretched
        self.kinetic: Any = 0
        if self.step is not None and (velocity := self.step.velocity) is not None:
            moving: list[Any] = [effect for effect in effects if "momentum" in effect.needs]
            self.kinetic = sum(effect.kinetic(_components(velocity)) for effect in moving) * self.dx
        self.kinds = 4 if variables[1].label() in extract_type(total_energy(acting, state), Label) else 3
        self.silent = [_silent(effect, body.frames) for effect in body.effects]
        instants = [*body.frames, *((a + b) / 2 for a, b in pairwise(body.frames))]
        self._made = {
            quiet: self._derivatives(total_energy(list(compress(acting, map(not_, quiet))), state) + at_rest, variables)
            for quiet in dict.fromkeys(map(self._quiet, instants))
        }
        self._isotropic = None if self.rest is None else self._derivatives(self.rest.isotropic(state), variables)
        self.set_amounts(body.frames[0])
        self.loads = self._loads(acting, state, unknowns)
        self.stretched: Any = ufl.derivative(stretched, unknowns) if stretched else 0

    def set_amounts(self, frame: float) -> None:
        """Set the amounts of effects at a frame, and select the derivatives without the effects that are left out at this frame."""
        for effect, amount in zip(self.effects, self.amounts, strict=True):
            amount.value = effect.amount(frame)
        self.derivatives = self._made[self._quiet(frame)]

    def _quiet(self, frame: float) -> tuple[bool, ...]:
        """True for each effect that is left out at a frame."""
        return tuple(any(a <= frame <= b for a, b in spans) for spans in self.silent)

    @contextmanager
    def isotropic(self) -> Iterator[None]:
        """A context in which ``derivatives`` are those of the isotropic body that gives a body in situ its stress at rest."""
        assert self._isotropic is not None  # a body in situ has it
        own, self.derivatives = self.derivatives, self._isotropic
        try:
            yield
        finally:
            self.derivatives = own

    def _derivatives(self, energy: Any, by: tuple[Any, Any, Any]) -> Derivatives:
        first, second = _differentiated(energy, by, self.kinds)
        return Derivatives(*compiling.expressions(first + second, self.rule[0], len(first)))

    def _stretched(self, acting: list[tuple[Effect, Any]], body: Body, state: State) -> Any:
        """The energy that effects store on the surface, 0 without any. Shares in regions vary linearly between vertices."""
        stored = [effect for effect, _ in acting if isinstance(effect, Load) and effect.stored]
        shares: dict[str, Any] = {}
        for name in regions_named(stored):
            share = shares[name] = fem.Function(fem.functionspace(self.mesh, ("Lagrange", 1)))
            share.x.array[:] = body.regions[name](share.function_space.tabulate_dof_coordinates())
        at, normal = replace(state, regions=shares), list(ufl.FacetNormal(self.mesh))
        return sum(effect.potential(at, normal) * self.measure(effect.on) for effect in stored)

    def _loads(self, acting: list[tuple[Effect, Any]], state: State, unknowns: fem.Function) -> Any:
        test, loads = ufl.TestFunction(unknowns.function_space), 0
        for effect, amount in acting:
            if isinstance(effect, Load) and not effect.stored:
                traction = effect.traction(replace(state, amount=amount), list(ufl.FacetNormal(self.mesh)))
                work = sum(a * b for a, b in zip(traction, ufl.split(test)[0], strict=True))
                loads -= work * self.measure(effect.on)
        return loads

    def measure(self, region: str) -> Any:
        """The measure of the facets of ``region``."""
        return self.ds(list(self.regions).index(region))

    def _fibre(self, body: Body, cells: Ints) -> list[Any] | None:
        """The fibre direction at the quadrature points; None unless an effect needs it."""
        if body.fibre is None or not any("fibre" in effect.needs for effect in body.effects):
            return None
        directions = body.fibre(np.repeat(cells, len(self.rule[0])), self._places(self.rule[0], cells))
        function = self._known(body, directions)
        return [function[i] for i in range(3)]

    def _regions(self, body: Body, cells: Ints) -> dict[str, Any]:
        """The shares, at the quadrature points, of the regions in which effects act."""
        if not regions_named(body.effects):
            return {}
        points, corners = self.rule[0], reference_nodes(body.mesh.kind, 1)
        within = points + INWARDS * (corners.mean(axis=0) - points)
        shares = body.shares(self._places(within, cells), np.repeat(cells, len(points)))
        return {name: self._known(body, share) for name, share in shares.items()}

    def _places(self, points: Floats, cells: Ints) -> Floats:
        """The rest positions (n, 3) [mm] of reference ``points`` (q, 3) in all cells."""
        return geometry(self.mesh, points, slice(len(cells)))[0].reshape(-1, 3)

    def _known(self, body: Body, values: Floats) -> fem.Function:
        """A function that takes the ``values`` (n, ...) at the quadrature points."""
        points, weights = self.rule
        shape = values.shape[1:]
        element = basix.ufl.quadrature_element(body.mesh.kind, value_shape=shape, points=points, weights=weights)
        function = fem.Function(fem.functionspace(self.mesh, element))
        function.x.array[: values.size] = values.ravel()
        function.x.scatter_forward()
        return function


@dataclass(frozen=True, eq=False)
class TimeStep:
    """A load step: the inverse duration ``rate`` [1/s], the unknowns ``before``, and with inertia the unknowns ``predicted`` and
    the ``velocity``.
    """

    rate: fem.Constant
    before: fem.Function
    predicted: fem.Function | None = None
    velocity: fem.Function | None = None


def _step(effects: list[Effect], space: fem.FunctionSpace) -> TimeStep | None:
    if not any("interval" in effect.needs for effect in effects):
        return None
    step = TimeStep(fem.Constant(space.mesh, 0.0), fem.Function(space))
    moving = any("momentum" in effect.needs for effect in effects)
    return replace(step, predicted=fem.Function(space), velocity=fem.Function(space)) if moving else step


def _state(
    unknowns: fem.Function, fibre: list[Any] | None, step: TimeStep | None
) -> tuple[State, tuple[Any, Any, Any]]:
    """The state at a point, and the variables of differentiation: F, the displacement, and the pressure (None if there is none)."""
    displacement, *others = (ufl.variable(part) for part in ufl.split(unknowns))
    F = ufl.variable(ufl.Identity(3) + ufl.grad(ufl.split(unknowns)[0]))
    timed: dict[str, Any] = {"F_before": _rows(F)}
    if step is not None:
        F_before = ufl.Identity(3) + ufl.grad(ufl.split(step.before)[0])
        timed = {"before": _components(step.before), "F_before": _rows(F_before), "rate": step.rate}
        if step.predicted is not None:
            timed["predicted"] = _components(step.predicted)
    state = State(
        F=_rows(F),
        displacement=[displacement[i] for i in range(3)],
        pressure=others[0] if others else None,
        fibre=fibre,
        functions=_FUNCTIONS,
        **timed,
    )
    return state, (F, displacement, state.pressure)


def _components(unknowns: fem.Function) -> list[Any]:
    """The components (3,) of the displacement in ``unknowns``."""
    return [ufl.split(unknowns)[0][i] for i in range(3)]


def _rows(F: Any) -> list[list[Any]]:
    return [[F[i, k] for k in range(3)] for i in range(3)]


def _silent(effect: Effect, frames: tuple[float, ...]) -> list[tuple[float, float]]:
    """The intervals, from one of the ``frames`` to the next, in which the energy of an ``effect`` is zero."""
    if not isinstance(effect, Energy) or not isinstance(effect, Ramped):
        return []
    knots = [knot.frame for knot in effect.ramp]
    return [
        (a, b)
        for a, b in pairwise(frames)
        if not any(map(effect.amount, (a, b, *(knot for knot in knots if a < knot < b))))
    ]


def _differentiated(energy: Any, by: tuple[Any, Any, Any], kinds: int) -> tuple[list[Any], list[Any]]:
    """The first derivatives of ``energy`` with respect to all variables (``kinds`` for each component of the displacement, then the
    pressure), and the upper triangle of the second derivatives, in the order of ``cells.c``.
    """
    F, displacement, pressure = by
    variables: list[tuple[Any, tuple[int, ...]]] = [
        (F, (i, k)) if k < 3 else (displacement, (i,)) for i in range(3) for k in range(kinds)
    ]
    variables += [(pressure, ())] if pressure is not None else []

    def slope(value: Any, variable: Any, where: tuple[int, ...]) -> Any:
        return ufl.diff(value, variable)[where] if where else ufl.diff(value, variable)

    first = [slope(energy, *variable) for variable in variables]
    second = [slope(one, *variable) for i, one in enumerate(first) for variable in variables[i:]]
    return first, second


def _symbolic(effect: Effect, msh: mesh.Mesh) -> Effect:
    """The effect with each numerical parameter replaced by a constant of the mesh."""
    symbols: dict[str, Any] = {}
    for name in type(effect).model_fields:
        value = getattr(effect, name)
        if isinstance(value, float):
            symbols[name] = fem.Constant(msh, value)
        elif isinstance(value, tuple) and all(isinstance(entry, float) for entry in value):
            symbols[name] = tuple(fem.Constant(msh, entry) for entry in value)
    return effect.model_copy(update=symbols)
