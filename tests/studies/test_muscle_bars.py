"""Error bars of several muscles by a stand-in for the solver: each has an error of its own and a share of its neighbour's."""

import json
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
import small
import stand_ins
import two_bars
from two_bars import AREAS, GIVES, SIZES, growth, swell

from fem_reference import cli, compare, error_bars, metrics, read_run, report, solve
from fem_reference.assessment.error_bars import FILE
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import vertex_areas
from fem_reference.io import files
from fem_reference.problems import muscle, muscles
from fem_reference.report import pages
from fem_reference.runs.store import Outcome
from fem_reference.scenes import casefile
from fem_reference.scenes.muscles import exactly_attached
from fem_reference.solvers import fenicsx
from fem_reference.studies import muscle_bars, refinement
from fem_reference.studies.execution import Bench

pytestmark = pytest.mark.slow


@pytest.fixture
def two(tmp_path, monkeypatch) -> Path:
    return two_bars.write(tmp_path / "two", monkeypatch)


def test_each_muscle_has_bars_of_its_own_pair_with_all_meshes_coarser(two, monkeypatch) -> None:
    monkeypatch.setattr(pages, "write", lambda _, folder, *__: folder)
    monkeypatch.setattr(report, "of_comparison", lambda _: None)
    target, store = two / "facts.json", two / "out" / "runs"
    words = ["run", str(two), "--error-bar", "--out", str(two / "out"), "--json", str(target), "--quiet"]
    assert cli.main(words) == cli.DONE
    printed = json.loads(target.read_text())["muscles"]
    case = casefile.read(two)
    reference = solve(case, store=store)
    assert set(muscle_bars.stored(Bench(case, store), reference)) == set(SIZES)
    bars = {name: error_bars(case, reference, muscle=name, store=store) for name in SIZES}
    fine, coarse = (one.problem() for one in (Bench(case, store), refinement.coarser(Bench(case, store))[0]))
    # Of order 1.5 in tetrahedra 1.5 times as large; the muscles touch, so that the factor of safety is the greater one of both.
    left = 1.25 / (1.5**1.5 - 1) * max(SIZES[name] / np.sqrt(AREAS[name] / np.pi) for name in SIZES)
    for name, other in (("wide", "thin"), ("thin", "wide")):
        counts = [[len(built.problems[one].mesh.tets) for one in (name, other)] for built in (fine, coarse)]
        assert (np.array(counts[1]) < counts[0]).all()
        surface = fine.problems[name].surface
        areas = vertex_areas(surface.points, surface.triangles)
        furthest = metrics.rms(np.linalg.norm(surface.points, axis=1)[None], areas)[0]
        # Twice the stiffness takes half of what contact gives away, twice that is all.
        share = np.hypot(left * (growth(*counts[0]) - growth(*counts[1])), GIVES)
        found = bars[name].find("change", "surface_deviation", "rms")
        assert found.values == pytest.approx(np.array([0, 5, 10, 15, 20]) * furthest * share, rel=1e-6)
        assert set(found.parts) == {
            "tetrahedra",
            *(f"contact between muscles {one}" for one in ("stiffness", "smoothing")),
        }
        rows = [
            row["value"]
            for row in printed[name]["error_bars"]
            if (row["of"], row["metric"], row["statistic"]) == ("change", "surface_deviation", "rms")
        ]
        assert rows == pytest.approx(found.values)
        assert bars[name].sizes == (SIZES[name], 1.5 * SIZES[name])
    for name in ("", "other"):
        with pytest.raises(InputError, match=r"muscle: got \"(other)?\", want one of wide, thin"):
            error_bars(case, reference, muscle=name, store=store)


@pytest.mark.parametrize("several", [True, False])
def test_bars_of_a_mesh_that_cannot_be_coarser_are_refused_before_anything_is_solved(
    two, monkeypatch, capsys, several
) -> None:
    """The mesher finds no part of the surface lost, up to the size that the case asks for."""
    mesher = muscle.tetrahedralise

    def tetrahedralise(surface, size, shares):
        if size > max(SIZES.values()):
            raise InputError("surface", "a part that is lost", "smaller tetrahedra")
        return mesher(surface, size, shares)

    monkeypatch.setattr(muscle, "tetrahedralise", tetrahedralise)
    case = two if several else small.write(two / "bar")
    words = ["run", str(case), "--out", str(two / "out"), "--quiet"]
    assert cli.main([*words, "--error-bar"]) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert "error bar, larger tetrahedra: got a scene that cannot be set up (" in said
    assert "a part that is lost, want smaller tetrahedra), want a finer reference" in said
    assert not list((two / "out").rglob("run.json"))


def test_further_runs_keep_their_states_in_which_the_second_check_sees_curved_facets(two, monkeypatch) -> None:
    kept = []

    def solve(problem, settings, sink) -> Outcome:
        kept.append(settings.store_state)
        return swell(problem, settings, sink)

    stand_ins.solve_by(monkeypatch, fenicsx, solve)
    bench = Bench(casefile.read(two), two / "runs")
    muscle_bars.obtain(bench, bench.reference())
    assert kept == 4 * [None]  # as the reference by default: yes, unless they are very large


@pytest.mark.parametrize("ended", ["denied", "diverged"])
def test_further_runs_that_the_second_check_denies_or_that_diverge_give_no_bar(two, monkeypatch, ended) -> None:
    counts = list[int]()

    def fail(problem, settings, sink) -> Outcome:
        counts.append(len(problem.rest.mesh.tets))
        if counts[-1] == counts[0]:
            return swell(problem, settings, sink)
        swell(problem, settings, lambda frame: None if frame.number else sink(frame))
        return Outcome("diverged", "no")

    if ended == "denied":
        stand_ins.deny_further_runs(monkeypatch)
    else:
        stand_ins.solve_by(monkeypatch, fenicsx, fail)
    bench = Bench(casefile.read(two), two / "runs")
    reference = bench.reference()
    assert reference.outcome.status == "converged"
    for found in muscle_bars.obtain(bench, reference).values():
        assert {bar.metric for bar in found.bars} > {"surface_deviation", "force_on_bone"}
        assert all(np.isnan(bar.values[1:]).all() for bar in found.bars)


def test_a_candidate_of_one_muscle_is_compared_in_python(two) -> None:
    """Frames at rest miss the whole growth of the thin muscle, which is known at each vertex; so do those of another program."""
    case, store = casefile.read(two), two / "runs"
    reference, thin = solve(case, store=store), files.read_surface(two / "thin.vtp", 1.0)
    (two / "still").mkdir()
    for number in case.numbers:
        files.write_surface(two / "still" / f"frame_{number:04d}.ply", thin, thin.points)
    still = read_run(two / "still", case, muscle="thin")
    counts = [len(one.mesh.tets) for one in Bench(case, store).problem().problems.values()]
    grows = growth(*counts[::-1]) + GIVES * 0.1 / case.touching.stiffness
    farthest = np.array(case.numbers) * grows * np.linalg.norm(thin.points, axis=1).max()
    found = compare(
        case, reference, [still], muscle="thin", error_bars=error_bars(case, reference, muscle="thin", store=store)
    )
    assert found["still", "surface_deviation", "max"].values == pytest.approx(farthest, rel=1e-6)
    assert found["reference", "neighbour_penetration", "deepest"].values == pytest.approx(0.0)
    with pytest.raises(KeyError):  # the candidate has no other muscle
        found["still", "neighbour_penetration", "deepest"]
    short = replace(
        reference, numbers=reference.numbers[:2], positions=reference.positions[:2], fibre_positions=None, scalars={}
    )
    assert np.isnan(compare(case, short, [still], muscle="thin")["still", "surface_deviation", "max"].values[2:]).all()
    pbd = solve(case, "pbd", muscle="thin", store=store)
    assert compare(case, reference, [pbd], muscle="thin")["pbd", "surface_deviation", "max"].values[-1] > 0
    for name, runs, why in (
        ("", [], "want one muscle, or the command compare"),
        ("other", [], 'muscle: got "other", want one of wide, thin'),
        ("wide", [pbd], "a run of another case"),
        ("wide", [reference], "a run of another case"),
    ):
        with pytest.raises(InputError, match=why):
            compare(case, reference, runs, muscle=name)
    with pytest.raises(InputError, match="want a solver for it, as the reference solves all muscles together"):
        solve(case, muscle="thin", store=store)


def test_a_muscle_with_the_name_of_a_folder_of_its_run_mixes_nothing(two) -> None:
    """Error bars of a muscle are in a folder with its name beside the frames, here in the folders of surfaces and of fibres."""
    path = two / "case.toml"
    path.write_text(
        path.read_text().replace('name = "wide"', 'name = "surface"').replace('name = "thin"', 'name = "fibres"')
    )
    bench = Bench(casefile.read(two), two / "runs")
    reference = bench.reference()
    made = muscle_bars.obtain(bench, reference)
    again = solve(casefile.read(two), store=two / "runs")
    assert again.folder == reference.folder
    assert np.array_equal(again.positions, reference.positions)
    for name, bars in muscle_bars.stored(bench, again).items():
        for stored, own in zip(bars.bars, made[name].bars, strict=True):
            assert stored.values == pytest.approx(own.values, nan_ok=True)


def test_bars_are_of_all_muscles_or_of_none_and_of_this_code(two) -> None:
    bench = Bench(casefile.read(two), two / "runs")
    reference = bench.reference()
    assert muscle_bars.stored(bench, reference) == {}
    muscle_bars.obtain(bench, reference)
    places = {name: reference.folder / name / FILE for name in SIZES}
    whole = places["thin"].read_text()
    places["thin"].unlink()
    assert muscle_bars.stored(bench, reference) == {}, "one is missing"
    table = json.loads(whole)
    places["thin"].write_text(json.dumps(table | {"of": table["of"] | {"metrics": "others"}}))
    assert muscle_bars.stored(bench, reference) == {}, "one is stale"
    made = muscle_bars.bars(bench, reference, "thin")
    assert places["thin"].read_text() == whole
    assert set(muscle_bars.stored(bench, reference)) == set(SIZES)
    volume = made.find("change", "volume", "deviation")
    assert set(volume.parts) > {"tetrahedra", "surface in tetrahedra"}
    # The muscles do not press each other: no cause of error is contact.
    apart = replace(reference, scalars=reference.scalars | {"touching_area": np.zeros(len(reference.numbers))})
    lone = muscle_bars.obtain(bench, apart)["thin"]
    assert set(lone.find("change", "volume", "deviation").parts) == {"tetrahedra", "surface in tetrahedra"}


def test_what_a_muscle_cannot_touch_does_not_make_its_bars_longer(two, monkeypatch) -> None:
    """The difference of forces on the floor by the closed form of a single value, which is of order 1 on sizes h and 1.5 h."""
    monkeypatch.setattr(muscles, "_gaps", lambda *_: {("wide", "thin"): 1.0})
    bench = Bench(casefile.read(two), two / "runs")
    bars = muscle_bars.obtain(bench, bench.reference())
    problems = [one.problem().problems for one in (bench, refinement.coarser(bench)[0])]
    for name, size in SIZES.items():
        fine, coarse = (growth(len(one[name].mesh.tets), 0) for one in problems)
        left = 1.25 * 1.2 / 0.5 * max(1.0, size / np.sqrt(AREAS[name] / np.pi))
        found = bars[name].find("change", "force_on_bone", "floor")
        assert found.parts["tetrahedra"] == pytest.approx(left * 20 * (fine - coarse), rel=1e-6)
        assert bars[name].find("change", "force_on_bone", "thin" if name == "wide" else "wide") is None


def test_muscles_that_touch_only_by_the_smoothing_that_a_variation_halves_press_by_nothing_there(
    two, monkeypatch
) -> None:
    """The gap of 0.15 mm is below the smoothing, 0.2 mm, and above half of it; the force between the two, 2 N, is all in doubt."""
    monkeypatch.setattr(muscles, "_gaps", lambda *_: {("wide", "thin"): 0.15})
    bench = Bench(casefile.read(two), two / "runs")
    bars = muscle_bars.obtain(bench, bench.reference())
    for name, other in (("wide", "thin"), ("thin", "wide")):
        found = bars[name].find("change", "force_on_bone", other)
        # Twice the difference between the coarse run and that without contact.
        assert found.parts["contact between muscles smoothing"] == pytest.approx(2 * 20 * (0.1 + GIVES * 0.1))
        assert np.isfinite(found.values).all()


@pytest.mark.parametrize(("own", "wanted", "ratio"), [((0, 1), (0, 1), 1.5), ((1, 2), (0, 1), 2.0)])
def test_all_muscles_are_coarser_by_the_same_ratio(two, own, wanted, ratio) -> None:
    changes = {f"muscle[{i}].refinements": count for i, count in enumerate(own)}
    case = casefile.read(two, changes=changes)
    found, by = refinement.coarser(Bench(case, two / "runs"))
    assert (tuple(one.refinements for one in found.scene.muscle), by) == (wanted, ratio)
    assert [one.tet_size for one in found.scene.muscle] == [
        (ratio if ratio == 1.5 else 1.0) * one.tet_size for one in case.muscle
    ]


def test_attachments_and_tetrahedra_of_each_muscle_vary(two) -> None:
    case = casefile.read(two, changes={"muscle[0].attachment[0].stiffness": "1 kPa/mm"})
    assert case.muscle[0].attachment[0].stiffness is not None
    assert exactly_attached(case).muscle[0].attachment[0].stiffness is None
    assert (
        refinement.finer(Bench(case, two), solve(casefile.read(two), store=two / "runs"), 0.8).muscle[1].tet_size == 4.0
    )


@pytest.mark.nightly  # by day a stand-in for the solver has the bars above
def test_the_reference_itself_has_bars_of_each_muscle_and_of_the_force_between_them(tmp_path) -> None:
    """By ``two_muscles`` at its quick size, to half of its motion: the bars of the force between the two are known."""
    case = casefile.read("two_muscles")
    bench = Bench(casefile.read("two_muscles", changes=case.quick | {"frames.last": 20}), tmp_path)
    found = muscle_bars.obtain(bench, bench.reference())
    bars = [found[name].find("change", "force_on_bone", other) for name, other in permutations(found)]
    assert all(np.isfinite(bar.values).all() for bar in bars)
    assert bars[0].values.max() > 0
