"""Results at points against closed forms: quadratic displacements, homogeneous states of every law, rotation, shear, viscosity."""

from dataclasses import replace

import numpy as np
import pytest
import shapes
from acting import TURN, make

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, TetMesh
from fem_reference.problems.body import reference_nodes
from fem_reference.problems.problem import AtRest
from fem_reference.runs import results, states, store
from fem_reference.runs.results import NAMES, Results
from fem_reference.runs.states import NodalState
from fem_reference.runs.writer import Writer
from validation import laws
from validation.fibre_laws import FibreActive, FibrePassive, FibrePassiveFebio

MESH = shapes.box((2, 2, 2), (4.0, 6.0, 8.0))
FIBRE = np.array([2.0, 3.0, 6.0]) / 7
FIBRES = np.tile(FIBRE, (len(MESH.tets), 1))
MU, BULK = 0.01, 10.0
NEO_HOOKE, INCOMPRESSIBLE = make("neo_hooke"), make("incompressible")
MATRIX = (NEO_HOOKE, INCOMPRESSIBLE)
F = np.array([[1.2, 0.1, -0.2], [0.05, 0.9, 0.15], [-0.1, 0.2, 1.1]])
POINTS = np.random.default_rng(3).uniform(0.01, 0.99, (40, 3)) * [4.0, 6.0, 8.0]


def nodes(mesh: TetMesh, degree: int) -> Floats:
    """Where the nodes of each tet are, (m, k, 3)."""
    places, corners = reference_nodes("tetrahedron", degree), mesh.points[mesh.tets]
    weights = np.column_stack([1 - places.sum(axis=1), places])
    return np.einsum("ka,mai->mki", weights, corners)


def moved(displacement, pressure=lambda X: 0 * X[..., 0], degree: int = 2) -> NodalState:
    """The state whose unknowns are functions of the rest position: (..., 3) -> (..., 3) and (...)."""
    corners = nodes(MESH, 1)
    return NodalState(displacement(nodes(MESH, degree)), pressure(corners), np.zeros((0, 0, 3)))


def affine(gradient: Floats):
    return lambda X: X @ (gradient - np.eye(3)).T


def at(state: NodalState, effects=MATRIX, points=POINTS, frame: float = 10.0, names=None) -> dict[str, Floats]:
    return Results(MESH, effects, {frame: state}, FIBRES).evaluate(points, frame, names)


def test_a_quadratic_displacement_and_a_linear_pressure_are_met_to_rounding() -> None:
    # A bar whose sections turn by 0.03 z, to first order: inside the space of quadratic tetrahedra.
    twist = 0.03

    def turned(X: Floats) -> Floats:
        return twist * np.stack([-X[..., 1] * X[..., 2], X[..., 0] * X[..., 2], 0 * X[..., 0]], axis=-1)

    found = at(moved(turned, lambda X: 0.5 + X @ [0.1, -0.2, 0.3]))
    x, y, z = POINTS.T
    zero, one = 0 * x, 1 + 0 * x
    rows = [[one, -twist * z, -twist * y], [twist * z, one, twist * x], [zero, zero, one]]
    gradient = np.moveaxis(np.array(rows), -1, 0)
    assert found["displacement"] == pytest.approx(turned(POINTS), abs=1e-13)
    assert found["deformation_gradient"] == pytest.approx(gradient, abs=1e-13)
    assert found["det_F"] == pytest.approx(1 + (twist * z) ** 2, abs=1e-13)
    assert found["pressure"] == pytest.approx(0.5 + POINTS @ [0.1, -0.2, 0.3], abs=1e-13)
    # sigma = mu J^(-5/3) dev(B) + p I (Holzapfel 2000, eq. 6.91 and 6.106 for neo-Hooke)
    B = gradient @ np.swapaxes(gradient, 1, 2)
    deviator = B - np.trace(B, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    stress = MU * (found["det_F"] ** (-5 / 3))[:, None, None] * deviator
    stress += found["pressure"][:, None, None] * np.eye(3)
    assert found["cauchy_stress"] == pytest.approx(stress, abs=1e-14)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("stretch", [0.7, 1.0, 1.6])
def test_a_block_stretched_along_one_axis(stretch: float, degree: int) -> None:
    # Incompressible neo-Hooke: sigma_xx = mu (l^2 - 1/l), free sides without stress (Rivlin 1948).
    gradient = np.diag([stretch, stretch**-0.5, stretch**-0.5])
    pressure = MU / 3 * (stretch**2 - 1 / stretch)
    found = at(moved(affine(gradient), lambda X: pressure + 0 * X[..., 0], degree))
    pull = MU * (stretch**2 - 1 / stretch)
    assert found["cauchy_stress"] == pytest.approx(np.tile(np.diag([pull, 0, 0]), (40, 1, 1)), abs=1e-15)
    assert found["von_mises"] == pytest.approx(np.full(40, abs(pull)), abs=1e-15)
    assert found["fibre_stretch"] == pytest.approx(np.full(40, np.linalg.norm(gradient @ FIBRE)), rel=1e-13)
    now = gradient @ FIBRE
    assert found["fibre_stress"] == pytest.approx(np.full(40, pull * now[0] ** 2 / (now @ now)), abs=1e-15)
    assert found["det_F"] == pytest.approx(np.ones(40), rel=1e-13)


def test_simple_shear() -> None:
    # sigma_xy = mu g, sigma_xx - sigma_yy = mu g^2, the plane's normal stresses equal (Rivlin 1948).
    amount = 0.8
    gradient = np.eye(3) + amount * np.outer([1, 0, 0], [0, 1, 0])
    stress = at(moved(affine(gradient)))["cauchy_stress"]
    assert stress[:, 0, 1] == pytest.approx(np.full(40, MU * amount), rel=1e-12)
    assert stress[:, 0, 0] - stress[:, 1, 1] == pytest.approx(np.full(40, MU * amount**2), rel=1e-12)
    assert stress[:, 1, 1] == pytest.approx(stress[:, 2, 2], abs=1e-16)
    assert stress[:, 2, :2] == pytest.approx(np.zeros((40, 2)), abs=1e-16)


def test_a_turned_body_has_no_stress() -> None:
    effects = (*MATRIX, make("mooney_rivlin"), make("guccione"), make("holzapfel_ogden"))
    found = at(moved(lambda X: X @ (TURN - np.eye(3)).T + [3.0, -2.0, 5.0]), effects)
    assert found["cauchy_stress"] == pytest.approx(np.zeros((40, 3, 3)), abs=1e-15)
    assert found["det_F"] == pytest.approx(np.ones(40), rel=1e-13)
    assert found["fibre_stretch"] == pytest.approx(np.ones(40), rel=1e-13)


# The amount of what has a ramp is 0.5 at frame 30.
LAWS = {
    "neo_hooke": laws.neo_hooke(MU),
    "mooney_rivlin": laws.MooneyRivlin(0.01, 0.004),
    "fibre_passive": FibrePassive(0.3, 0.05, 6.6, 1.1, 1.4),
    "fibre_passive_febio": FibrePassiveFebio(0.01, 12.0, 3.0, 1.3),
    "fibre_active": FibreActive(0.3, 1.1, 0.5),
    "active_tension": laws.ActiveTension(0.03),
    "holzapfel_ogden": laws.HolzapfelOgden(0.02, 1.5, np.deg2rad(30), (0.2, 0.5, 2.0)),
    "guccione": laws.Guccione(0.002, 8.0, 2.0, 4.0),
}


@pytest.mark.parametrize("prestretched", [False, True])
@pytest.mark.parametrize("name", LAWS)
def test_the_stress_of_every_law(name: str, prestretched: bool) -> None:
    # sigma = P F^T / J with P as validation/laws.py has it by hand.
    law = laws.Prestretched(LAWS[name], 1.05) if prestretched else LAWS[name]
    effects = (make(name), make("prestretch")) if prestretched else (make(name),)
    stress = at(moved(affine(F)), effects, frame=30.0, names=["cauchy_stress"])["cauchy_stress"]
    expected = law.stress(F, FIBRE) @ F.T / np.linalg.det(F)
    assert stress == pytest.approx(np.tile(expected, (40, 1, 1)), rel=1e-10, abs=1e-14)
    assert stress == pytest.approx(np.swapaxes(stress, 1, 2), abs=1e-14)


def test_a_penalty_on_volume_change_is_a_pressure() -> None:
    gradient = 1.1 * np.eye(3)
    state = NodalState(affine(gradient)(nodes(MESH, 2)), np.zeros((len(MESH.tets), 0)), np.zeros((0, 0, 3)))
    stress = at(state, (make("incompressible_penalty"),))["cauchy_stress"]
    assert stress == pytest.approx(np.tile(BULK * (1.1**3 - 1) * np.eye(3), (40, 1, 1)), rel=1e-11)


def test_energies_of_effects_are_their_densities_times_the_volume() -> None:
    """``mu/2 (l^2 + 2/l - 3)`` of incompressible neo-Hooke (Rivlin 1948); half of an effect with a ramp; contact has none."""
    stretch, volume = 1.3, 4.0 * 6 * 8
    state = moved(affine(np.diag([stretch, stretch**-0.5, stretch**-0.5])))
    effects = (NEO_HOOKE, make("active_tension"), make("contact"))
    found = Results(MESH, effects, {30.0: state}, FIBRES).energies(30.0)
    assert set(found) == {"neo_hooke", "active_tension"}
    along = np.sum((np.array([stretch, stretch**-0.5, stretch**-0.5]) * FIBRE) ** 2)
    assert found["active_tension"] == pytest.approx(volume * 0.5 * 0.06 / 2 * (along - 1), rel=1e-12)
    assert found["neo_hooke"] == pytest.approx(volume * MU / 2 * (stretch**2 + 2 / stretch - 3), rel=1e-12)
    assert set(Results(MESH, (*MATRIX, NEO_HOOKE), {30.0: state}).energies(30.0)) == {"neo_hooke", "incompressible"}
    twice = Results(MESH, (NEO_HOOKE, NEO_HOOKE), {30.0: state}).energies(30.0)
    assert twice["neo_hooke"] == pytest.approx(2 * found["neo_hooke"], rel=1e-12)


def test_energy_and_stress_of_a_law_are_those_of_its_region() -> None:
    """The half of a box below a plane through faces of its tetrahedra has its own law: the stress jumps there."""
    stretch, volume, middle = 1.3, 4.0 * 6 * 8, 4.0
    state = moved(affine(np.diag([stretch, stretch**-0.5, stretch**-0.5])))
    laws = tuple(make("neo_hooke", mu=mu, **{"in": at}) for mu, at in (("10 kPa", "not tendon"), ("40 kPa", "tendon")))
    made = Results(
        MESH, laws, {30.0: state}, regions={"tendon": lambda points: np.where(points[:, 2] < middle, 1.0, 0.0)}
    )
    density = (stretch**2 + 2 / stretch - 3) / 2
    assert made.energies(30.0) == {"neo_hooke": pytest.approx(volume * density * 0.025, rel=1e-12)}
    found = made.evaluate(np.array([[1.0, 1, middle - 0.1], [1, 1, middle + 0.1]]), 30.0)["von_mises"]
    assert found == pytest.approx(np.array([0.04, 0.01]) * (stretch**2 - 1 / stretch), rel=1e-9)


def test_an_energy_that_varies_is_integrated() -> None:
    """With ``u = b x^2`` along x, J = 1 + 2 b x, and a penalty ``K/2 (J - 1)^2`` integrates to ``2 K b^2 X^2 / 3`` per volume."""
    b, bulk = 0.01, 10.0
    bent = moved(lambda X: np.stack([b * X[..., 0] ** 2, 0 * X[..., 0], 0 * X[..., 0]], axis=-1))
    state = replace(bent, pressure=np.zeros((len(MESH.tets), 0)))
    found = Results(MESH, (make("incompressible_penalty"),), {0.0: state}).energies(0.0)
    assert found["incompressible_penalty"] == pytest.approx(4.0 * 6 * 8 * 2 / 3 * bulk * (b * 4) ** 2, rel=1e-12)


@pytest.mark.parametrize("angle", [1.3, 2.0, 2.8])
def test_fibres_by_their_energy_have_the_arm_of_their_excursion(angle: float) -> None:
    """A bar between a fixed point and one that turns, 40 and 30 mm from a hinge, is stretched evenly along its fibres.

    Their moment, minus the slope of their energy, over their tension is ``-a b sin(t) / l``, minus the slope of their length, to
    rounding of differences. The matrix pulls on the same line, so it has the same arm, and so have both together.
    """
    a, b, rest, step = 40.0, 30.0, 45.0, 1e-5
    fibre = np.tile([0.0, 0, 1], (len(MESH.tets), 1))

    def length(at: float) -> float:
        return float(np.sqrt(a**2 + b**2 - 2 * a * b * np.cos(at)))

    def energies(at: float) -> dict[str, float]:
        across = (length(at) / rest) ** -0.5
        state = moved(affine(TURN @ np.diag([across, across, across**-2])))
        return Results(MESH, (NEO_HOOKE, make("fibre_passive")), {0.0: state}, fibre).energies(0.0)

    low, high = energies(angle - step), energies(angle + step)
    moments = {name: -(high[name] - low[name]) / (2 * step) for name in low}
    stretch, section = length(angle) / rest, 4.0 * 6 * 8 / rest
    law = FibrePassive(0.3, 0.05, 6.6, 1.1, 1.4)
    forces = {"neo_hooke": section * MU * (stretch - stretch**-2), "fibre_passive": section * law.slope(stretch)}
    arm = -a * b * np.sin(angle) / length(angle)
    for name, force in forces.items():
        assert moments[name] == pytest.approx(force * arm, rel=1e-6)
    assert (forces["fibre_passive"] > 0) == (angle > 1.5)  # slack in the first pose
    assert sum(moments.values()) / sum(forces.values()) == pytest.approx(arm, rel=1e-6)


def test_viscosity_resists_the_rate_of_a_small_step() -> None:
    # sigma = 2 eta D to first order in the step; weight and drag have no stress.
    rate, step = 4.0, np.array([[1e-6, 2e-6, 0], [0, -1e-6, 3e-6], [1e-6, 0, 0]])
    state = replace(moved(affine(np.eye(3) + step)), before=0 * nodes(MESH, 2), rate=rate)
    stress = at(state, (make("viscosity"), make("gravity"), make("damping")))["cauchy_stress"]
    expected = 2 * 0.3 * rate * (step + step.T) / 2
    assert stress == pytest.approx(np.tile(expected, (40, 1, 1)), abs=1e-5 * np.abs(expected).max())


def test_what_has_no_energy_has_no_stress() -> None:
    for effects in ((), (make("gravity"),), (make("pressure"), make("contact"))):
        assert not at(moved(affine(F)), effects)["cauchy_stress"].any()


def test_a_pressure_that_is_constant_in_each_cell() -> None:
    constant = np.arange(len(MESH.tets), dtype=float)[:, None]
    made = Results(MESH, (), {0: replace(moved(affine(F)), pressure=constant)})
    centres = nodes(MESH, 1).mean(axis=1)
    assert made.evaluate(centres, 0, ["pressure"])["pressure"].tolist() == constant[:, 0].tolist()


def test_a_point_outside_has_no_value_and_one_on_the_skin_has() -> None:
    points = np.array([[2.0, 3.0, 4.0], [2.0, 3.0, 8.0 + 1e-6], [0.0, 0.0, 0.0], [4.0, 6.0, 8.0], [9.0, 3.0, 4.0]])
    found = at(moved(affine(F)), points=points)
    for name in NAMES:
        there = np.isfinite(found[name].reshape(5, -1)).all(axis=1)
        none = np.isnan(found[name].reshape(5, -1)).all(axis=1)
        assert there.tolist() == (~none).tolist() == [True, False, True, True, False]


def test_no_points_are_no_values() -> None:
    found = at(moved(affine(F)), points=np.zeros((0, 3)))
    assert {name: len(values) for name, values in found.items()} == dict.fromkeys(NAMES, 0)


def test_a_state_turned_inside_out_has_no_stress() -> None:
    found = at(moved(affine(np.diag([-1.0, 1, 1]))))
    assert found["det_F"] == pytest.approx(-np.ones(40))
    assert np.isnan(found["cauchy_stress"]).all()
    assert np.isnan(found["von_mises"]).all()


def test_many_points_are_as_few() -> None:
    points = np.random.default_rng(4).uniform(0.01, 0.99, (2500, 3)) * [4.0, 6.0, 8.0]
    state = moved(lambda X: 0.01 * X**2)
    many, some = at(state, points=points), at(state, points=points[2000:2010])
    for name in NAMES:
        assert np.array_equal(many[name][2000:2010], some[name])


def test_bad_input_is_named() -> None:
    made = Results(MESH, MATRIX, {0: moved(affine(F)), 10: moved(affine(F))}, FIBRES)
    with pytest.raises(InputError, match="frame: got 5, want one of 0, 10"):
        made.evaluate(POINTS, 5)
    with pytest.raises(InputError, match='names: got "strain", want one of displacement, '):
        made.evaluate(POINTS, 0, ["strain"])
    with pytest.raises(InputError, match=r"points: got an array \(3,\), want finite coordinates"):
        made.evaluate([1.0, 2.0, 3.0], 0)
    with pytest.raises(InputError, match="entries that are not finite"):
        made.evaluate([[1.0, np.nan, 3.0]], 0)
    bare = Results(MESH, (), {0: replace(moved(affine(F)), pressure=np.zeros((len(MESH.tets), 0)))})
    for name in ("pressure", "fibre_stretch"):
        assert name not in bare.evaluate(POINTS, 0)
        with pytest.raises(InputError, match=f'names: got "{name}"'):
            bare.evaluate(POINTS, 0, [name])
    other = Results(shapes.box((1, 1, 1), (1, 1, 1)), (), {0: moved(affine(F))})
    with pytest.raises(InputError, match="as the mesh has 6 tetrahedra"):
        other.evaluate(POINTS, 0)


def stored(folder, state: NodalState | None, fibre: Floats | None = FIBRES) -> Writer:
    """A run of one frame."""
    surface = shapes.skin(MESH)
    identity = {"name": "reference", "solver": "test", "origin": {"scene": "none"}, "frames": (0,)}
    writer = Writer(folder, identity, AtRest(surface, None, MESH, fibre))
    writer.add(store.Frame(0, surface.points, points=MESH.points, state=state))
    writer.close(store.Outcome("converged", "done"))
    return writer


def test_states_are_read_as_they_were_written(tmp_path) -> None:
    state = replace(moved(affine(F), lambda X: X[..., 0]), before=nodes(MESH, 2), rate=2.5)
    stored(tmp_path / "run", state)
    mesh, fibre = states.read_rest(tmp_path / "run")
    (read,) = states.StoredStates(tmp_path / "run", (0,)).values()
    assert np.array_equal(mesh.points, MESH.points)
    assert np.array_equal(mesh.tets, MESH.tets)
    assert np.array_equal(fibre, FIBRES)
    for name, values in state.arrays.items():
        assert np.array_equal(getattr(read, name), values)
    assert sorted(path.name for path in (tmp_path / "run" / "state").iterdir()) == ["frame_0000.npz", "rest.npz"]


def test_a_run_without_states_another_scene_or_a_damaged_file_is_named(tmp_path) -> None:
    stored(tmp_path / "bare", None)
    with pytest.raises(InputError, match="a run without states, want a run of the reference, solved with store_state"):
        results.of_run(tmp_path / "bare", "hip_flexion")
    stored(tmp_path / "run", moved(affine(F)), None)
    assert states.read_rest(tmp_path / "run")[1] is None
    with pytest.raises(InputError, match=r"a run of a scene other than .*hip_flexion"):
        results.of_run(tmp_path / "run", "hip_flexion")
    (tmp_path / "run" / "state" / "frame_0000.npz").write_bytes(b"PK\x03\x04 half")
    with pytest.raises(InputError, match=r"frame_0000.npz: .* want the arrays displacement, pressure, before, rate"):
        states.StoredStates(tmp_path / "run", (0,))[0]


IN_SITU = (*MATRIX, make("in_situ"))


def in_situ() -> NodalState:
    """A state in situ, whose stress at rest varies."""
    own = moved(lambda X: 1e-3 * X**2, lambda X: 0.01 * X[..., 1])
    return replace(moved(affine(F)), response=own.displacement, response_pressure=own.pressure)


def test_a_stored_state_in_situ_has_its_stress_at_rest(tmp_path) -> None:
    """What was written is what was solved: stress, pressure and energies are as in memory, to rounding, and not as without it."""
    stored(tmp_path / "run", in_situ())
    read = states.StoredStates(tmp_path / "run", (0,))
    kept, back = (Results(MESH, IN_SITU, one, FIBRES) for one in ({0: in_situ()}, read))
    bare = Results(MESH, MATRIX, {0: moved(affine(F))}, FIBRES)
    one, other, without = (made.evaluate(POINTS, 0) for made in (kept, back, bare))
    for name, values in one.items():
        assert other[name] == pytest.approx(values, rel=1e-12, abs=1e-15), name
    for name in ("pressure", "cauchy_stress"):
        assert np.abs(one[name] - without[name]).max() > 1e-3
    assert back.energies(0) == pytest.approx(kept.energies(0), rel=1e-12)
    assert abs(back.energies(0)["in_situ"]) > 1e-3


def test_a_state_in_situ_without_its_stress_at_rest_is_refused(tmp_path) -> None:
    half = replace(in_situ(), response_pressure=np.zeros((0, 0)))
    for name, state in (("none", moved(affine(F))), ("half", half)):
        stored(tmp_path / name, state)
        made = Results(MESH, IN_SITU, states.StoredStates(tmp_path / name, (0,)), FIBRES)
        for ask in (lambda made: made.evaluate(POINTS, 0), lambda made: made.energies(0)):
            with pytest.raises(
                InputError, match=r"state at frame 0: got arrays response .* response_pressure \(0, 0\)"
            ):
                ask(made)
