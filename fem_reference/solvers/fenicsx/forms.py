"""The weak form of a body, summed from its effects; symbols stand for their parameters, so that a compiled form serves many."""

from dataclasses import replace
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh

from fem_reference.continuum import Continuum
from fem_reference.effects import Effect, Energy, Load, State, total_energy
from fem_reference.mesh import Floats, Ints
from fem_reference.solvers.fenicsx import meshes, quadrature
from fem_reference.solvers.fenicsx.settings import BodySettings

Rule = tuple[Floats, Floats]


class UflFunctions:
    """``effects.Functions`` of UFL expressions."""

    exp = staticmethod(ufl.exp)
    log = staticmethod(ufl.ln)
    sqrt = staticmethod(ufl.sqrt)
    cos = staticmethod(ufl.cos)
    sin = staticmethod(ufl.sin)

    @staticmethod
    def above(x: Any, limit: Any, then: Any, otherwise: Any) -> Any:
        """``then`` where ``x > limit``, else ``otherwise``."""
        return ufl.conditional(ufl.gt(x, limit), then, otherwise)


class Form:
    """``energy`` that is stored and ``volume`` as integrals, ``residual`` as what vanishes in equilibrium, det F as
    ``determinant``; to be set: ``amounts`` by effect, ``rate`` [1/s] of the load step and the unknowns ``before`` it (None where
    time does not matter); ``rule``: points (q, 3) and weights (q,) of the quadrature, of ``degree``; ``regions``: by name, this
    rank's facets.
    """

    def __init__(
        self, msh: mesh.Mesh, body: Continuum, unknowns: fem.Function, settings: BodySettings, cells: Ints
    ) -> None:
        """``cells``: which cell of the body each of this rank's is."""
        self.mesh, self.regions = msh, meshes.local_facets(msh, body.mesh.facets)
        self.rule = quadrature.rule(settings.element, settings.quadrature_degree)
        self.degree = settings.quadrature_degree or quadrature.DEGREE[settings.element]
        self.dx, self.ds = _measures(msh, self.regions, self.rule, self.degree)
        self.amounts = [fem.Constant(msh, effect.amount(body.frames[0])) for effect in body.effects]
        effects = [_symbolic(effect, msh) for effect in body.effects]
        acting = list(zip(effects, self.amounts, strict=True))
        timed = any("interval" in effect.needs for effect in effects)
        self.before, self.rate = fem.Function(unknowns.function_space) if timed else None, fem.Constant(msh, 0.0)
        state = _state(unknowns, self._fibre(body, cells), self.before, self.rate)
        self.determinant = state.J
        stored = [(effect, amount) for effect, amount in acting if not isinstance(effect, Energy) or effect.stored]
        self.volume, self.energy = state.J * self.dx, total_energy(stored, state) * self.dx
        test = ufl.TestFunction(unknowns.function_space)
        step = ufl.TrialFunction(unknowns.function_space)
        self.residual = ufl.derivative(total_energy(acting, state) * self.dx, unknowns, test)
        for effect, amount in acting:
            if isinstance(effect, Load):
                traction = effect.traction(replace(state, amount=amount), list(ufl.FacetNormal(msh)))
                work = sum(a * b for a, b in zip(traction, ufl.split(test)[0], strict=True))
                self.residual -= work * self.measure(effect.on)
        self.tangent = ufl.derivative(self.residual, unknowns, step)

    def measure(self, region: str) -> Any:
        """The measure of the facets of ``region``."""
        return self.ds(list(self.regions).index(region))

    def _fibre(self, body: Continuum, cells: Ints) -> list[Any] | None:
        """The fibre direction at the quadrature points, where an effect asks for it."""
        if body.fibre is None or not any("fibre" in effect.needs for effect in body.effects):
            return None
        points, weights = self.rule
        element = basix.ufl.quadrature_element(body.mesh.kind, value_shape=(3,), points=points, weights=weights)
        function = fem.Function(fem.functionspace(self.mesh, element))
        mine = np.arange(len(cells), dtype=np.int32)
        places = meshes.coordinates(self.mesh, points).eval(self.mesh, mine).reshape(-1, 3)
        directions = body.fibre(np.repeat(cells, len(points)), places)
        function.x.array[: directions.size] = directions.ravel()
        function.x.scatter_forward()
        return [function[i] for i in range(3)]


def _measures(msh: mesh.Mesh, regions: dict[str, Ints], rule: Rule, degree: int) -> tuple[Any, Any]:
    """The measures of the cells, by a rule, and of the facets, by number of region and of a degree."""
    points, weights = rule
    inside = {"quadrature_rule": "custom", "quadrature_points": points, "quadrature_weights": weights}
    kind = fem.IntegralType.exterior_facet
    parts = [
        (i, fem.compute_integration_domains(kind, msh.topology, facets)) for i, facets in enumerate(regions.values())
    ]
    return (
        ufl.Measure("dx", domain=msh, metadata={"quadrature_degree": degree} | inside),
        ufl.Measure("ds", domain=msh, subdomain_data=parts, metadata={"quadrature_degree": degree}),
    )


def _state(unknowns: fem.Function, fibre: list[Any] | None, before: fem.Function | None, rate: fem.Constant) -> State:
    displacement, *others = ufl.split(unknowns)
    passed = ufl.as_vector((0.0, 0.0, 0.0)) if before is None else ufl.split(before)[0]
    return State(
        F=_gradient(displacement),
        displacement=[displacement[i] for i in range(3)],
        pressure=others[0] if others else None,
        fibre=fibre,
        before=[passed[i] for i in range(3)],
        F_before=_gradient(displacement if before is None else passed),
        rate=rate,
        functions=UflFunctions(),
    )


def _gradient(displacement: Any) -> list[list[Any]]:
    """The deformation gradient (3, 3)."""
    F = ufl.Identity(3) + ufl.grad(displacement)
    return [[F[i, k] for k in range(3)] for i in range(3)]


def _symbolic(effect: Effect, msh: mesh.Mesh) -> Effect:
    """The effect with a constant of the mesh in place of each number among its parameters."""
    values = {name: getattr(effect, name) for name in type(effect).model_fields}
    symbols: dict[str, Any] = {
        name: fem.Constant(msh, value) for name, value in values.items() if isinstance(value, float)
    }
    for name, value in values.items():
        if isinstance(value, tuple) and all(isinstance(entry, float) for entry in value):
            symbols[name] = tuple(fem.Constant(msh, entry) for entry in value)
    return effect.model_copy(update=symbols)
