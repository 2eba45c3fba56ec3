"""Our second solver for problems in plane strain on a quadrilateral, with finite elements of high order on a graded grid, in numpy
and scipy alone.

The displacement is a continuous tensor polynomial of degree p on Gauss-Lobatto nodes; the pressure q is a polynomial of total
degree p - 1, discontinuous between cells. ``integral of W(grad u) + q v(grad u) - q^2 / 2K - load . u`` is stationary, with W
the isochoric energy [MPa] and v the change of volume. Newton's method solves for both unknowns together; the unknowns inside each
cell are eliminated (static condensation). Units: mm, N, MPa; loads and forces per mm of thickness.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu
from scipy.special import roots_jacobi

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Response(NamedTuple):
    """The response of a law to displacement gradients (..., 2, 2): the derivative of W (..., 2, 2) and its tangent
    (..., 2, 2, 2, 2) [MPa]; v (...), its derivative (..., 2, 2) and its constant second derivative (2, 2, 2, 2).
    """

    stress: Floats
    tangent: Floats
    volume: Floats
    area: Floats
    turn: Floats


Law = Callable[[Floats], Response]


@dataclass(frozen=True, eq=False)
class Grid:
    """Cells of a quadrilateral: ``nodes`` (n, 2) [mm] at rest and ``cells`` (m, k), their indices; at the quadrature points
    ``weights`` (m, q) [mm2], ``gradients`` (m, q, k, 2) [1/mm] of the shape functions and ``pressures`` (q, r), the values of the
    pressure polynomials; ``clamped``: the nodes of the first side; ``load`` (n,) [mm]: the integrals of the shape functions over
    the opposite side.
    """

    nodes: Floats
    cells: Ints
    weights: Floats
    gradients: Floats
    pressures: Floats
    clamped: Ints
    load: Floats
    order: int


@dataclass(frozen=True, eq=False)
class Rested:
    """The equilibrium of a body: ``displacement`` (n, 2) [mm] of the nodes, and ``fixed`` (2,) [N/mm], the force on the clamped
    side.
    """

    displacement: Floats
    fixed: Floats


def _outer(a: Floats, b: Floats) -> Floats:
    """The product ``a_ik b_jl`` (..., 2, 2, 2, 2) of arrays (..., 2, 2), with the indices i, k, j, l."""
    return np.asarray(np.einsum("...ik,...jl->...ikjl", a, b))


def _wide(numbers: Floats, more: int) -> Floats:
    """``numbers`` (...) with ``more`` trailing axes of length 1."""
    return numbers[(..., *[None] * more)]


_ONE = np.eye(2)
_SAME = np.einsum("ij,kl->ikjl", _ONE, _ONE)
_TURN = np.einsum("ij,kl->ikjl", [[0.0, 1.0], [-1.0, 0.0]], [[0.0, 1.0], [-1.0, 0.0]])


def _volume(slope: Floats) -> tuple[Floats, Floats, Floats]:
    """F (..., 2, 2) of a displacement gradient ``slope``, its determinant J (...) and its cofactors (..., 2, 2)."""
    F = _ONE + slope
    area = np.einsum("ikjl,...jl->...ik", _TURN, F)
    return F, np.einsum("...ik,...ik->...", area, F) / 2, area


def neo_hooke(shear: float) -> Law:
    """``W = mu/2 (J^(-2/3) (tr C + 1) - 3)`` and ``v = J - 1``, with F and C in the plane and mu = ``shear`` [MPa].

    Source: Simo and Taylor, Comput. Methods Appl. Mech. Eng. 85 (1991) 273-310, doi 10.1016/0045-7825(91)90100-K.
    """

    def law(slope: Floats) -> Response:
        F, J, area = _volume(slope)
        scale, third = shear * J ** (-2 / 3), (np.einsum("...ik,...ik->...", F, F) + 1) / 3
        back = area / _wide(J, 2)
        stress = _wide(scale, 2) * (F - _wide(third, 2) * back)
        cross = _outer(F, back) + _outer(back, F)
        bent = 5 / 3 * _outer(back, back) - _TURN / _wide(J, 4)
        tangent = _wide(scale, 4) * (_SAME - 2 / 3 * cross + _wide(third, 4) * bent)
        return Response(stress, tangent, J - 1, area, _TURN)

    return law


def coupled_neo_hooke(shear: float, lame: float) -> Law:
    """``W = mu/2 (tr C - 2) + lambda/4 (J^2 - 1) - (lambda/2 + mu) ln J``, which needs no pressure (``v = J - 1``, to be
    used with a negligible bulk modulus); mu = ``shear``, lambda = ``lame`` [MPa].

    Source: Wriggers, Nonlinear Finite Element Methods, 2008, doi 10.1007/978-3-540-71001-1.
    """

    def law(slope: Floats) -> Response:
        F, J, area = _volume(slope)
        first = lame / 2 * J - (lame / 2 + shear) / J
        second = lame / 2 + (lame / 2 + shear) / J**2
        tangent = shear * _SAME + _wide(second, 4) * _outer(area, area) + _wide(first, 4) * _TURN
        return Response(shear * F + _wide(first, 2) * area, tangent, J - 1, area, _TURN)

    return law


def small_strain(shear: float) -> Law:
    """``W = mu e : e`` with the deviatoric strain e, and ``v = tr(strain)``: Hooke's law, mu = ``shear`` [MPa]."""
    stiffness = shear * (_SAME + np.einsum("il,kj->ikjl", _ONE, _ONE) - 2 / 3 * _outer(_ONE, _ONE))

    def law(slope: Floats) -> Response:
        many = slope.shape[:-2]
        stress = np.einsum("ikjl,...jl->...ik", stiffness, slope)
        volume = np.einsum("...ii->...", slope)
        tangent = np.broadcast_to(stiffness, (*many, 2, 2, 2, 2))
        return Response(stress, tangent, volume, np.broadcast_to(_ONE, (*many, 2, 2)), np.zeros_like(_TURN))

    return law


def graded(layers: int, ratio: float) -> Floats:
    """Ticks of [0, 1] with intervals that decrease geometrically towards 0: 0, ratio^layers, ..., ratio, 1."""
    return np.append(0.0, ratio ** np.arange(layers, -1, -1.0))


def _lobatto(order: int) -> Floats:
    """The ends of [-1, 1] and the extrema of the Legendre polynomial of degree ``order``, (order + 1,)."""
    return np.concatenate([[-1.0], roots_jacobi(order - 1, 1, 1)[0], [1.0]])


def _shapes(order: int, at: Floats) -> tuple[Floats, Floats]:
    """Values and derivatives (q, order + 1) at ``at`` (q,) of the polynomials that are 1 at one Gauss-Lobatto node and 0 at the
    others.
    """
    coefficients = np.linalg.inv(legendre.legvander(_lobatto(order), order))
    slopes = legendre.legder(coefficients, axis=0)
    return legendre.legvander(at, order) @ coefficients, legendre.legvander(at, order - 1) @ slopes


class _Shapes(NamedTuple):
    """A cell on the square [-1, 1]^2 at Gauss points: ``weights`` (q,), ``derivatives`` (q, k, 2) of the shape functions and
    values ``pressures`` (q, r); ``edge`` (order + 1,): the integrals over an edge.
    """

    weights: Floats
    derivatives: Floats
    pressures: Floats
    edge: Floats


def _quadrature(order: int) -> _Shapes:
    """The cell of degree ``order`` with ``order + 2`` Gauss points along each side."""
    points, share = legendre.leggauss(order + 2)
    value, slope = _shapes(order, points)
    many = len(points) ** 2
    first = np.einsum("qa,rb->qrab", slope, value).reshape(many, -1)
    second = np.einsum("qa,rb->qrab", value, slope).reshape(many, -1)
    degrees = [(i, j) for i in range(order) for j in range(order - i)]
    table = np.asarray(legendre.legvander(points, order - 1), dtype=np.float64)
    pressures = np.stack([np.outer(table[:, i], table[:, j]).ravel() for i, j in degrees], axis=1)
    return _Shapes(np.outer(share, share).ravel(), np.stack([first, second], axis=-1), pressures, share @ value)


def _spread(ticks: Floats, local: Floats) -> Floats:
    """Points ``local`` (k,) of [-1, 1] in each interval of ``ticks``, (intervals, k)."""
    return ticks[:-1, None] + np.diff(ticks)[:, None] * (local + 1) / 2


def grid(corners: Sequence[tuple[float, float]], across: Floats, along: Floats, order: int) -> Grid:
    """A grid of cells of degree ``order`` >= 2 on a quadrilateral with ``corners`` [mm], counter-clockwise. The side between the
    last and the first corner is clamped; ``across``: ticks of [0, 1] from this side to the opposite one, ``along``: along both.
    """
    a, b, c, d = np.array(corners)
    local = _lobatto(order)
    s, t = (np.append(_spread(ticks, local)[:, :-1].ravel(), 1.0) for ticks in (across, along))
    S, T = np.meshgrid(s, t, indexing="ij")
    place = [S.ravel()[:, None], T.ravel()[:, None]]
    nodes = a + (b - a) * place[0] + (d - a) * place[1] + (a - b + c - d) * place[0] * place[1]
    numbers = np.arange(len(nodes)).reshape(S.shape)
    starts = [(i * order, j * order) for i in range(len(across) - 1) for j in range(len(along) - 1)]
    cells = np.array([numbers[i : i + order + 1, j : j + order + 1].ravel() for i, j in starts])

    shapes = _quadrature(order)
    jacobian = np.einsum("mki,qks->mqis", nodes[cells], shapes.derivatives)
    weights = shapes.weights * np.linalg.det(jacobian)
    gradients = np.einsum("qks,mqsi->mqki", shapes.derivatives, np.linalg.inv(jacobian), optimize=True)
    load = np.zeros(len(nodes))
    side = np.lib.stride_tricks.sliding_window_view(numbers[-1], order + 1)[::order]
    lengths = np.diff(along) * np.linalg.norm(c - b) / 2
    np.add.at(load, side, np.outer(lengths, shapes.edge))
    return Grid(nodes, cells, weights, gradients, shapes.pressures, numbers[0], load, order)


def _system(body: Grid, law: Law, bulk: float, u: Floats, q: Floats) -> tuple[Floats, Floats]:
    """Matrices (m, 2k + r, 2k + r) and residuals (m, 2k + r) of the cells: two components at each node, then the pressures."""
    G, w, N = body.gradients, body.weights, body.pressures
    m, points, k, _ = G.shape
    answer = law(np.einsum("mqak,mai->mqik", G, u[body.cells], optimize=True))
    pressure = q @ N.T
    flow = answer.stress + pressure[..., None, None] * answer.area
    stiffness = answer.tangent + pressure[..., None, None, None, None] * answer.turn
    half = np.einsum("mq,mqak,mqikjl->maiqjl", w, G, stiffness, optimize=True).reshape(m, 2 * k, points, 2, 2)
    inner = np.stack(
        [half[..., j, :].reshape(m, 2 * k, -1) @ G.transpose(0, 1, 3, 2).reshape(m, -1, k) for j in (0, 1)], axis=-1
    ).reshape(m, 2 * k, 2 * k)
    mixed = np.einsum("mq,mqak,mqik->maiq", w, G, answer.area, optimize=True).reshape(m, 2 * k, -1) @ N
    mass = np.einsum("mq,qr,qs->mrs", w, N, N, optimize=True)
    matrix = np.block([[inner, mixed], [mixed.transpose(0, 2, 1), -mass / bulk]])
    forces = np.einsum("mq,mqak,mqik->mai", w, G, flow, optimize=True).reshape(m, 2 * k)
    change = (w * (answer.volume - pressure / bulk)) @ N
    return matrix, np.concatenate([forces, change], axis=1)


def _split(order: int, pressures: int) -> tuple[Ints, Ints]:
    """Indices of the unknowns of a cell on its boundary, and of those inside it, among them all pressures."""
    number = np.arange((order + 1) ** 2).reshape(order + 1, order + 1)
    inside = number[1:-1, 1:-1].ravel()
    rim = np.setdiff1d(number, inside)
    two = np.arange(2)
    last = 2 * number.size + np.arange(pressures)
    return (2 * rim[:, None] + two).ravel(), np.concatenate([(2 * inside[:, None] + two).ravel(), last])


def _newton_step(body: Grid, matrix: Floats, residual: Floats, load: Floats) -> tuple[Floats, Floats]:
    """Changes of the displacement (n, 2) and of the pressures (m, r)."""
    k, r = body.cells.shape[1], body.pressures.shape[1]
    rim, inside = _split(body.order, r)
    unknowns = (2 * body.cells[:, :, None] + np.arange(2)).reshape(-1, 2 * k)[:, rim]
    right = np.concatenate([matrix[:, inside][:, :, rim], -residual[:, inside, None]], axis=2)
    local = np.linalg.solve(matrix[:, inside][:, :, inside], right)
    coupling = matrix[:, rim][:, :, inside]
    reduced = matrix[:, rim][:, :, rim] - coupling @ local[..., :-1]
    target = load.ravel().copy()
    np.add.at(target, unknowns, -residual[:, rim] - (coupling @ local[..., -1:])[..., 0])

    size = 2 * len(body.nodes)
    rows = np.broadcast_to(unknowns[:, :, None], reduced.shape)
    whole = coo_matrix((reduced.ravel(), (rows.ravel(), rows.transpose(0, 2, 1).ravel())), (size, size)).tocsc()
    free = np.setdiff1d(np.unique(unknowns), 2 * body.clamped[:, None] + np.arange(2))
    change = np.zeros(size)
    change[free] = splu(whole[free][:, free]).solve(target[free])
    interior = local[..., -1] - np.einsum("mij,mj->mi", local[..., :-1], change[unknowns])
    nodal = len(inside) - r
    change[(2 * body.cells[:, :, None] + np.arange(2)).reshape(-1, 2 * k)[:, inside[:nodal]]] = interior[:, :nodal]
    return change.reshape(-1, 2), interior[:, nodal:]


def rest(body: Grid, law: Law, bulk: float, traction: tuple[float, float], steps: int = 1) -> Rested:
    """The equilibrium of ``body`` under a dead ``traction`` (2,) [MPa] on the side opposite to the clamped side, applied in
    ``steps``; ``bulk`` is K [MPa]. ArithmeticError if Newton's method does not converge.
    """
    u, q = np.zeros_like(body.nodes), np.zeros((len(body.cells), body.pressures.shape[1]))
    for share in np.arange(1, steps + 1) / steps:
        u, q = _balance(body, law, bulk, share * np.outer(body.load, traction), (u, q))
    forces = _system(body, law, bulk, u, q)[1][:, : 2 * body.cells.shape[1]].reshape(*body.cells.shape, 2)
    return Rested(u, np.asarray(forces[np.isin(body.cells, body.clamped)].sum(axis=0)))


def _balance(body: Grid, law: Law, bulk: float, load: Floats, start: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Displacement (n, 2) and pressures (m, r) in equilibrium with ``load`` (n, 2) [N/mm], by Newton's method from ``start``."""
    u, q = start
    for _ in range(30):
        with np.errstate(invalid="ignore"):
            matrix, residual = _system(body, law, bulk, u, q)
        if not np.isfinite(residual).all():
            raise ArithmeticError("Newton: got a cell turned inside out, want smaller steps of the load")
        step, change = _newton_step(body, matrix, residual, load)
        u, q = u + step, q + change
        if np.abs(step).max() < 1e-9 * np.abs(u).max():
            return u, q
    raise ArithmeticError(
        f"Newton: got a last step of {np.abs(step).max()} mm after 30, want less than 1e-9 of the displacement"
    )
