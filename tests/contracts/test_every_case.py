"""Every shipped case: its expectations pass, and with its negative control applied the verdict turns to fail."""

import json
import os

import pytest

from fem_reference import cli, report
from fem_reference.assessment.judge import MET
from fem_reference.cli.demo import MAIN_JOB
from fem_reference.cli.page import OCTAVE
from fem_reference.geometry import skins
from fem_reference.problems.fibre_ends import REACHES
from fem_reference.report import pages
from fem_reference.scenes import casefile
from fem_reference.scenes.case import DATA_SETTING
from fem_reference.scenes.scalar import ScalarCase
from fem_reference.studies import judging

pytestmark = pytest.mark.slow

# The motion there and back at its two ends and a middle; the bulk of the time is the number of frames.
FEW = {"frames.every": 100}

CASES = {name: casefile.read(name) for name in casefile.cases()}
FIELDS = [name for name, case in CASES.items() if isinstance(case, ScalarCase)]
BOX = "box_squeeze"  # which test_box_squeeze solves and judges
MUSCLES = [name for name, case in CASES.items() if case.parts and not case.unsolved]
SOLVED = [name for name in CASES if name not in (*FIELDS, *MUSCLES, MAIN_JOB, BOX) and not CASES[name].unsolved]
UNSOLVED = [name for name, case in CASES.items() if case.unsolved]


def spoiled(name: str) -> tuple[object, ...]:
    """Which effects a case has and what its negative control does to them."""
    case = CASES[name]
    assert case.negative_control is not None
    return tuple(map(type, case.effects)), case.negative_control.key, case.negative_control.value


# The same muscles attached otherwise, the box of the report beside our own, and a case without a solution take longest: at night.
AT_NIGHT = (
    *("box_squeeze_report", "gluteus_maximus_anatomical", "gluteus_maximus_tract", "gluteus_medius_anatomical"),
    *("adductor_brevis", "iliacus_anatomical", "iliacus_in_situ", "hip_four_muscles", *UNSOLVED),
)


def often(names, at_night=AT_NIGHT):
    """The cases, those at night marked."""
    return [pytest.param(name, marks=pytest.mark.nightly) if name in at_night else name for name in names]


# Cases in which this is the same would show the same: the first of them. By day the main job is enough, as most soften the bulk.
CONTROLS = list({spoiled(name): name for name in reversed([MAIN_JOB, *sorted(SOLVED, key=AT_NIGHT.count)])}.values())


def quickly(name: str) -> dict[str, object]:
    """Changes with which a case is solved in test time, if its data is here."""
    if CASES[name].needed_data and DATA_SETTING not in os.environ:
        pytest.skip(f"its anatomy is in {DATA_SETTING}, which is not set")
    return FEW | CASES[name].quick


def solved_quickly(name: str, changes: dict[str, object], **more: bool):
    """A case with these changes, which expects only what is of frames that are solved."""
    scene = casefile.read(name, changes=changes, **more)
    return scene.model_copy(update={"expect": tuple(e for e in scene.expect if e.frame in ("any", *scene.numbers))})


def whole(name: str, *, with_negative_control: bool, folder, monkeypatch) -> tuple[int, dict]:
    """Exit status and facts of a scalar case with all its candidates; how it converges is for its page."""
    monkeypatch.setattr(judging, "_REFINEMENTS", {2: 0, 3: 0})
    scene = casefile.read(name, with_negative_control=with_negative_control)
    return run(scene, folder, monkeypatch, verb="compare")


@pytest.mark.usefixtures("without_page")
@pytest.mark.parametrize("name", FIELDS)
def test_scalar_cases_meet_their_expectations_and_fail_with_their_negative_control(name, tmp_path, monkeypatch) -> None:
    if name not in OCTAVE:  # the test of that page asks those
        status, facts = whole(name, with_negative_control=False, folder=tmp_path / "right", monkeypatch=monkeypatch)
        assert (status, facts["verdict"], facts["status"]) == (cli.DONE, "pass", "converged")
    status, facts = whole(name, with_negative_control=True, folder=tmp_path / "wrong", monkeypatch=monkeypatch)
    assert (status, facts["verdict"]) == (cli.VERDICT_FAIL, "fail")
    # What two solvers of the same equations differ by is rounding, whatever they are.
    assert {v["verdict"] for v in facts["verdicts"] if (v["of"], v["metric"]) == ("fenicsx", "difference")} <= {"pass"}


@pytest.mark.parametrize("name", ["rod", "plate_square", "plate_spiral"])
def test_scalar_cases_by_the_listing_alone(name, tmp_path, monkeypatch) -> None:
    status, facts = run(CASES[name], tmp_path, monkeypatch, "--solver", "listing")
    assert (status, facts["verdict"], facts["status"]) == (cli.DONE, "pass", "converged")


def test_the_page_of_the_octave_examples(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(judging, "_MOST_CELLS", 30_000)  # one refinement fewer: a quarter of the time
    target = tmp_path / "facts.json"
    status = cli.main(["page", "octave-examples", "--out", str(tmp_path), "--json", str(target), "--quiet"])
    facts = json.loads(target.read_text())
    assert status == cli.DONE
    assert [case["case"] for case in facts["cases"]] == list(OCTAVE)
    for case in facts["cases"]:
        assert case["verdict"] == "pass"
        # scikit-fem and FEniCSx, the same elements on the same mesh: rounding.
        (apart,) = [
            row["value"] for row in case["measures"] if (row["candidate"], row["metric"]) == ("fenicsx", "difference")
        ]
        assert apart < 1e-9
    orders = {
        (case["case"], ladder["element"]): ladder["order"] for case in facts["cases"] for ladder in case["convergence"]
    }
    # Linear elements are of order 2 in L2 where the right side is square integrable and values are attached along a rim.
    for name in ("rod", "plate_square", "plate_spiral"):
        assert orders[name, "P1"] == pytest.approx(2, abs=0.1)
    assert orders["rod", "P2"] is None, "a parabola lies in the space: what is left is rounding"
    assert orders["surface_figure", "P1"] < 1.5, "a surface does not feel a value attached at a point"
    stored = [path.parent for path in (tmp_path / "runs").glob("*/run.json")]
    assert len(stored) == 3 * len(facts["cases"])
    assert all(
        (folder / "field.pvd").is_file() and (folder / "field" / "frame_0000.vtu").is_file() for folder in stored
    )
    page = (tmp_path / "octave-examples.html").read_text()
    assert page.count("<h2") > len(facts["cases"])


# The muscles that keep their volume with the negative control too, as they hardly become longer.
KEPT = {"hip_four_muscles": ("iliacus", "adductor_brevis")}


@pytest.mark.nightly
@pytest.mark.usefixtures("without_page")
@pytest.mark.parametrize("name", often(MUSCLES))
def test_several_muscles_meet_their_expectations_and_fail_with_their_negative_control(
    name, tmp_path, monkeypatch
) -> None:
    for control, status, word in ((False, cli.DONE, "pass"), (True, cli.VERDICT_FAIL, "fail")):
        scene = casefile.read(name, changes=quickly(name) | {"frames.every": 20}, with_negative_control=control)
        found, facts = run(scene, tmp_path / word, monkeypatch, verb="compare")
        assert found == status
        kept = KEPT.get(name, ()) if control else ()
        wanted = {one: "pass" if one in kept else word for one in facts["muscles"]}
        assert {one: result["verdict"] for one, result in facts["muscles"].items()} == wanted
        assert {one["solver"] for one in facts["penetration"]} == {"reference", *(one.name for one in scene.candidate)}


@pytest.fixture
def without_page(monkeypatch) -> None:
    """Numbers alone are made: the page of the main job is looked at."""
    monkeypatch.setattr(report, "of_comparison", lambda _: None)
    monkeypatch.setattr(pages, "write", lambda _, folder, *__: folder)


def run(scene, folder, monkeypatch, *more: str, verb: str = "run"):
    folder.mkdir(exist_ok=True)
    target = folder / "facts.json"
    with monkeypatch.context() as patch:
        patch.setattr(casefile, "read", lambda _, **__: scene)
        status = cli.main([verb, scene.name, "--out", str(folder), "--json", str(target), "--quiet", *more])
    return status, json.loads(target.read_text())


def rows(facts, metric, statistic):
    found = [row for row in facts["measures"] if (row["metric"], row["statistic"]) == (metric, statistic)]
    return {row["frame"]: row["value"] for row in found if row["candidate"] == "reference"}


# Of muscles of the hip: the number of ends more than 2 mm from their attachment, where dissected fibres lie beside the report's
# attachments, and of those that go on by a tendon. The dissected fibres are five, and cover no attachment; traced ones cover each.
BESIDE, BY_TENDON = {"gluteus_maximus": 7}, {"gluteus_maximus_anatomical": 5, "gluteus_maximus_tract": 5}
COVERED = 90  # [%] at least of the area of an attachment


def check_ends(name: str, facts) -> None:
    """Every fibre ends within 2 mm of its attachment, and in all frames within 2 mm of where its bone takes it, or is named."""
    if "femur" not in {bone.name for bone in CASES[name].bone}:
        return
    mesh = facts["mesh"]
    named, tied = (mesh.get(f"fibre_ends_{words}", "").count("of fibre") for words in ("not_attached", "continued_by"))
    assert (named, tied) == (BESIDE.get(name, 0), BY_TENDON.get(name, 0))
    assert (mesh["fibre_ends_beside"], mesh.get("fibre_ends_continued", 0)) == (named, tied)
    if named + tied == 0:
        assert min(value for key, value in mesh.items() if key.endswith("_covered_percent")) > COVERED
        off = [value for value in rows(facts, "fibre_ends", "max").values() if value is not None]
        assert max(off) <= REACHES
        assert len(off) > 1


@pytest.mark.nightly  # by day ``.ci/run`` runs it as it is shipped, and tests/house/test_main_job.py asks a small case
def test_main_job(tmp_path, monkeypatch) -> None:
    # The motion there alone, on a few tetrahedra, one surface of few Gaussians.
    (few,) = (i for i, one in enumerate(CASES[MAIN_JOB].candidate) if one.solver == "rbf_muscle")
    quick = {"muscle.tet_size": "12 mm", "muscle.refinements": 0, "frames.last": 100, "frames.every": 50}
    quick[f"candidate[{few}].gaussians"] = 10
    scene, target = solved_quickly(MAIN_JOB, quick), tmp_path / "facts.json"
    monkeypatch.setattr(casefile, "read", lambda _: scene)
    status = cli.main(["demo", "--out", str(tmp_path), "--json", str(target), "--quiet"])
    facts = json.loads(target.read_text())
    assert (status, facts["verdict"] in MET, facts["status"]) == (cli.DONE, True, "converged")
    frames = {row["frame"] for row in facts["measures"] if row["candidate"] == "pbd"}
    assert frames == {0, 50, 100}
    metrics = {row["metric"] for row in facts["measures"] if row["candidate"] == "pbd"}
    surface = {"dihedral_angle", "edge_extension", "inversion", "surface_deviation", "volume"}
    assert metrics == surface | {"fibre_ends", "fibre_length", "moment_arm", "penetration"}
    page = (tmp_path / "hip_flexion" / "report.html").read_text()
    assert page.count('src="data:image/webp') >= 4, "the pictures are missing"


@pytest.mark.nightly
@pytest.mark.usefixtures("without_page")
def test_gluteus_maximus_against_the_recorded_output(data, tmp_path) -> None:
    target, recorded = tmp_path / "facts.json", data / "candidates" / "report_pbd_gluteus_maximus"
    status = cli.main(
        [
            "compare",
            "gluteus_maximus",
            "--candidate",
            str(recorded),
            "--set",
            "muscle.refinements=0",
            "--set",
            "muscle.tet_size=14 mm",
            "--out",
            str(tmp_path),
            "--json",
            str(target),
            "--quiet",
        ]
    )
    facts = json.loads(target.read_text())
    assert (status, facts["verdict"] in MET, facts["status"]) == (cli.DONE, True, "converged")
    volume = rows(facts, "volume", "deviation")
    assert sorted(volume) == list(range(0, 301, 10))
    assert max(map(abs, volume.values())) < 0.5
    assert rows(facts, "surface_deviation", "max")[300] < 0.05
    # The report's program states its greatest displacement, 132.5 mm at iteration 100, of vertices that both attach alike.
    assert rows(facts, "surface_deviation", "max")[100] == pytest.approx(132.5, abs=1)


def test_gluteus_maximus_with_a_truncated_frame(data, tmp_path, capsys) -> None:
    folder = tmp_path / "cut"
    folder.mkdir()
    for path in (data / "candidates" / "report_pbd_gluteus_maximus").glob("*.ply"):
        content = path.read_bytes()
        (folder / path.name).write_bytes(content[: len(content) // 2] if path.stem == "frame_0120" else content)
    assert (
        cli.main(["compare", "gluteus_maximus", "--candidate", str(folder), "--out", str(tmp_path / "out")])
        == cli.BAD_INPUT
    )
    assert "frame_0120.ply" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.fixture
def coarse_contact(monkeypatch) -> None:
    """A quarter of the points at which a body between plates is in contact: its triangles are not cut."""
    monkeypatch.setattr(skins, "_ACROSS", 20)


BY_DAY = [pytest.param(name, {"frames.last": 100}) for name in SOLVED if name not in AT_NIGHT]


@pytest.mark.usefixtures("without_page")
@pytest.mark.parametrize(
    ("name", "half"), [*BY_DAY, *(pytest.param(name, {}, marks=pytest.mark.nightly) for name in SOLVED)]
)
def test_muscles_meet_their_expectations(name, half, tmp_path, monkeypatch, request) -> None:
    """By day as far as the middle of the motion: there and back ``.ci/run`` solves the main job."""
    scene = solved_quickly(name, quickly(name) | half)
    if not scene.attachment:
        request.getfixturevalue("coarse_contact")
    status, facts = run(scene, tmp_path, monkeypatch)
    assert (status, facts["verdict"] in MET, facts["status"]) == (cli.DONE, True, "converged")
    check_ends(name, facts)
    assert scene.frames.numbers[1:] == tuple(range(100, scene.frames.last + 1, 100))


@pytest.mark.usefixtures("without_page")
@pytest.mark.parametrize("name", often(CONTROLS, {*CONTROLS} - {MAIN_JOB}))
def test_muscles_with_negative_control_fail(name, tmp_path, monkeypatch, request) -> None:
    # As far as the middle of the motion: what is expected there is expected of any frame.
    scene = solved_quickly(name, quickly(name) | {"frames.last": 100}, with_negative_control=True)
    if not scene.attachment:
        request.getfixturevalue("coarse_contact")
    status, facts = run(scene, tmp_path, monkeypatch)
    assert status == cli.VERDICT_FAIL
    failed = {verdict["metric"] for verdict in facts["verdicts"] if verdict["verdict"] == "fail"}
    # Bulk is felt in the volume, tension at rest by the fibres.
    felt = {"bulk": "volume", "stretch": "fibre_length"}
    assert felt.get(scene.negative_control.key.rpartition(".")[2], "penetration") in failed


@pytest.mark.usefixtures("without_page", "coarse_contact")
def test_half_the_bulk_modulus_of_the_box_doubles_its_change_of_volume(tmp_path, monkeypatch) -> None:
    status, facts = run(casefile.read(BOX, changes=FEW, with_negative_control=True), tmp_path, monkeypatch)
    assert (status, facts["verdict"]) == (cli.VERDICT_FAIL, "fail")
    volume = rows(facts, "volume", "deviation")
    assert volume[100] == pytest.approx(2 * -0.267, abs=0.02)  # percent; half the bulk modulus
    assert volume[300] == pytest.approx(0, abs=1e-6)


@pytest.mark.usefixtures("without_page")
@pytest.mark.parametrize("name", often(UNSOLVED))
def test_an_unsolved_case_says_where_and_why_and_keeps_what_it_reached(name, tmp_path, monkeypatch) -> None:
    scene = casefile.read(name, changes=quickly(name))
    status, facts = run(scene, tmp_path, monkeypatch)
    assert status == cli.SOLVER_FAILED
    facts = next(iter(facts["muscles"].values())) if scene.parts else facts
    assert facts["status"] in ("diverged", "inverted")
    assert "the smallest det F is" in facts["message"]
    assert "the deepest contact is" in facts["message"]
    reached = [frame for frame, value in rows(facts, "volume", "deviation").items() if value is not None]
    assert reached[:2] == list(scene.frames.numbers[:2])


@pytest.mark.usefixtures("without_page")
def test_a_negative_control_that_turns_nothing_says_so(tmp_path, capsys) -> None:
    # It changes a candidate, which run does not judge.
    words = ["rod", "--negative-control", "--out", str(tmp_path), "--quiet"]
    said = "negative control: the verdict is pass but should be fail"
    assert cli.main(["run", *words]) == cli.DONE
    assert said in capsys.readouterr().out
    for verb in (["compare"], ["run", "--solver", "listing"]):
        assert cli.main([*verb, *words]) == cli.VERDICT_FAIL
        assert said not in capsys.readouterr().out
