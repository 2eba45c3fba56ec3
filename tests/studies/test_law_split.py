"""The error of a solver is the sum of what it left out, its law, its mesh and its convergence: each is found where it was put."""

from dataclasses import replace

import numpy as np
import pytest
import turned_bar

import fem_reference as fr
from fem_reference.foundations.errors import InputError
from fem_reference.metrics import context_of, find, measure
from fem_reference.studies import law_split
from fem_reference.studies.execution import Bench

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bar")
    case = fr.load_case(turned_bar.write(folder / "bar"), {"muscle.tet_size": "30 mm", "frames.last": 10})
    return Bench(case, folder / "runs")


def test_lames_parameters_are_those_of_the_matrix(bench) -> None:
    # mu = 10 kPa and K = 2 mu (1 + nu) / (3 (1 - 2 nu)) of nu = 0.45; less where a solver has a smaller ratio.
    assert law_split.lame(bench.scene, 0.49) == pytest.approx((0.01, 0.09))
    assert law_split.lame(bench.scene, 0.3) == pytest.approx((0.01, 0.015))
    for effects in (
        (fr.make_effect("neo_hooke", mu=0.01),),
        (fr.make_effect("neo_hooke", mu=0.01, **{"in": "fat"}), *bench.scene.effect),
    ):
        with pytest.raises(InputError, match="want one law of the whole muscle"):
            law_split.lame(bench.scene.model_copy(update={"effect": effects}), 0.45)


def test_stiffness_of_another_effect_is_refused(bench) -> None:
    # Collagen across the fibre adds shear that no solver of the matrix alone takes; fibres add none.
    across = fr.make_effect("collagen_across", k1="4 kPa", k2=1.0)
    with pytest.raises(InputError, match="modulus of another effect"):
        law_split.lame(bench.scene.model_copy(update={"effect": (*bench.scene.effect, across)}), 0.45)


def test_what_nobody_holds_exactly_is_not_split(bench) -> None:
    soft = [
        one.model_copy(update={"stiffness": 1e-9}) for one in bench.scene.attachment
    ]  # times 100 mm: 1e-7 of 0.01 MPa
    law = law_split.law_of("st_venant_kirchhoff", bench.scene, 0.45)
    for held, got in ((soft, "springs softer than the muscle: "), ([], "attachment: got nothing")):
        other = Bench(bench.scene.model_copy(update={"attachment": tuple(held)}), bench.store)
        other.reference = bench.reference  # which is not asked how it is held
        with pytest.raises(InputError, match=got):
            law_split.split(other, bench.reference(), law)


def test_each_part_is_found_where_it_was_put(bench) -> None:
    law = law_split.law_of("st_venant_kirchhoff", bench.scene, 0.45)
    own = bench.scene.model_copy(
        update={"effect": (law,), "reference": bench.scene.reference.model_copy(update={"element": "P1"})}
    )
    exact = Bench(own, bench.store).reference()
    found = law_split.split(bench, exact, law)
    assert found.frame == 10
    assert list(found.parts) == ["left out", "law", "mesh", "convergence"]
    assert found.parts["left out"] == found.parts["convergence"] == 0
    assert found.parts["law"] > 0.01
    assert found.parts["mesh"] > 0.1
    assert found.total <= sum(found.parts.values())
    reference = bench.reference()
    measures = measure(exact, reference, context_of(bench.setup(), reference), ["surface_deviation"])
    assert found.total == pytest.approx(find(measures, "surface_deviation", "rms").worst.value, rel=1e-12)
    # 1 mm everywhere, with law and mesh as before.
    off = replace(exact, positions=exact.positions + [0, 0, 1.0])
    assert law_split.split(bench, off, law).parts["convergence"] == pytest.approx(1)
    assert law_split.split(bench, off, law).parts["law"] == found.parts["law"]
    torn = replace(exact, positions=np.where(np.arange(2)[:, None, None] == 1, np.nan, off.positions))
    assert law_split.split(bench, torn, law).frame == 0  # the frames that it reached


def test_what_is_left_out_is_a_part_of_its_own(bench) -> None:
    fibres = fr.make_effect("fibre_passive", stress="300 kPa", p1=0.05, p2=6.6, optimal_stretch=0.95, linear_from=1.4)
    case = bench.scene.model_copy(update={"effect": (*bench.scene.effect, fibres)})
    law = law_split.law_of("stable_neo_hooke", case, 0.45)
    found = law_split.split(Bench(case, bench.store), bench.reference(), law)  # a solver of all but the fibres
    assert found.total == found.parts["left out"] > 0.1


def test_a_law_without_shear_at_rest_has_references_too(bench) -> None:
    # Far from neo-Hooke: 0.9 mm on the bar of 486 tetrahedra, where stable neo-Hooke is 0.06 mm.
    off = np.zeros((2, 1, 3))
    off[1] = 1.0  # [mm] in the last frame, which the parts are of
    run = replace(bench.reference(), positions=bench.reference().positions + off)
    weak, stiff = (
        law_split.split(bench, run, law_split.law_of(name, bench.scene, 0.45)).parts
        for name in ("squared_invariants", "stable_neo_hooke")
    )
    assert weak["left out"] == 0
    assert weak["law"] > stiff["law"] > 0


def test_a_law_without_a_solution_is_refused(bench) -> None:
    reference = bench.scene.reference.model_copy(update={"newton_iterations": 1})
    case = bench.scene.model_copy(update={"reference": reference})
    with pytest.raises(InputError, match="want one that reaches all frames"):
        law_split.split(Bench(case, bench.store), bench.reference(), law_split.law_of("stable_neo_hooke", case, 0.45))
