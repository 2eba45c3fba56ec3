"""The reference timed by phase, also against a commit: what is compared, what the table has, and what is refused."""

import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest
import small

from fem_reference import cli
from fem_reference.problems.body import ByCell
from fem_reference.problems.checks import check
from fem_reference.scenes.case import DATA_SETTING
from fem_reference.studies.benchmark import checkout, reference, reference_table, timing
from fem_reference.studies.benchmark.checkout import Commit
from fem_reference.studies.benchmark.reference import BEFORE, NOW, Taken, Timing

pytestmark = pytest.mark.slow

COMMIT = Commit("HEAD~3", "0" * 40, "0000000")
TINY = ("Q1/P0", 1, 3)


def taken(wall: float, status: str = "converged", **cost: float) -> Taken:
    return Taken(status, "as it was", "f" * 64, wall, wall / 2, {"seconds_solve": wall - 1, **cost})


@pytest.fixture
def compared() -> Timing:
    """Two repeats a side whose costs have a phase each that the other has not, and a node 0.3 mm away from where it was."""
    before = (taken(8.0, seconds_back_substitution=0.5), taken(9.0, seconds_back_substitution=0.5))
    now = (taken(2.0, seconds_krylov=0.25, unknowns=240.0), taken(3.0, seconds_krylov=0.35, unknowns=240.0))
    positions = np.arange(12.0).reshape(4, 3)
    moved = positions + np.array([[0, 0, 0], [0, 0.1, 0.2], [0.1, 0.2, 0.2], [0, 0, 0]])
    return Timing("spindle", {BEFORE: before, NOW: now}, {BEFORE: positions, NOW: moved})


@pytest.fixture
def repository() -> None:
    """The tests run where there is a history."""
    done = subprocess.run(
        ["git", "-C", checkout.ROOT, "rev-parse", "--show-toplevel"], capture_output=True, check=False
    )
    if done.returncode != 0 or Path(done.stdout.decode().strip()).resolve() != checkout.ROOT:
        pytest.skip("this is no git repository")


def test_ratios_are_of_neighbouring_repeats(compared) -> None:
    found = compared.ratio("seconds_wall")
    assert (found.median, found.minimum, found.maximum) == (3.5, 3.0, 4.0)
    assert compared.ratio("seconds_krylov") is None
    assert compared.ratio("seconds_back_substitution") is None
    assert reference.ratio([1.0, 2.0], [0.0, 1.0]) is None


def test_the_difference_is_the_greatest_distance_of_a_node(compared) -> None:
    assert compared.difference == pytest.approx(0.3)


def test_what_failed_is_not_compared(compared) -> None:
    failed = (*compared.taken[BEFORE][:1], taken(9.0, "diverged"))
    made = Timing("spindle", compared.taken | {BEFORE: failed}, compared.positions)
    assert (made.ratio("seconds_wall"), made.difference, made.converged) == (None, None, False)
    assert made.values(BEFORE, "seconds_back_substitution") is None
    assert "0000000: diverged, as it was" in reference_table.text([made], COMMIT, {})
    json.dumps(reference_table.facts([made], COMMIT, {}), allow_nan=False)


def test_the_table_has_the_phases_of_both(compared) -> None:
    rows = [line.split() for line in reference_table.text([compared], COMMIT, {}).splitlines()]
    assert rows[1][:2] == ["0000000", "now"]
    cells = {row[0]: row[1:] for row in rows if row}
    assert cells["wall"][:3] == ["[s]", "8.50", "2.50"]
    assert cells["wall"][3:] == ["3.50", "(3.00", "to", "4.00)"]
    assert cells["krylov"] == ["[s]", "-", "0.30"]
    assert cells["back_substitution"] == ["[s]", "0.50", "-"]
    assert cells["unknowns"] == ["-", "240"]
    assert "final positions: 0.3 mm" in reference_table.text([compared], COMMIT, {})


def test_json_has_every_repeat(compared) -> None:
    facts = reference_table.facts([compared], COMMIT, {"muscle": "no data"})
    (body,) = facts["bodies"]
    assert facts["against"] == {"asked": "HEAD~3", "commit": "0" * 40}
    assert facts["left_out"] == {"muscle": "no data"}
    assert [one["seconds_wall"] for one in body["sides"][BEFORE]] == [8.0, 9.0]
    assert body["ratios"]["seconds_wall"] == {"median": 3.5, "minimum": 3.0, "maximum": 4.0}
    assert body["difference_mm"] == pytest.approx(0.3)


def test_without_the_data_it_is_said_what_is_left_out(monkeypatch) -> None:
    monkeypatch.delenv(DATA_SETTING, raising=False)
    names, left_out = reference.default()
    assert names == list(reference.FUSIFORM)
    assert list(left_out) == list(reference.WITH_DATA)
    assert f"gluteus_maximus: left out, its data is not here: {DATA_SETTING}" in reference_table.text(
        [], None, left_out
    )
    monkeypatch.setenv(DATA_SETTING, "somewhere")
    assert reference.default() == ([*reference.FUSIFORM, *reference.WITH_DATA], {})


@pytest.mark.parametrize("element", ["Q1/P0", "P2/P0", "P2/P1"])
def test_the_fusiform_body_can_be_solved(element) -> None:
    body = timing.fusiform(element, 1, 4)
    check(body, element)
    radius, z = np.linalg.norm(body.mesh.points[:, :2], axis=1), body.mesh.points[:, 2]
    thick, thin = (radius[np.isclose(z, height)].max() for height in (timing.LENGTH / 2, 0))
    assert (thick, thin) == pytest.approx((timing.RADIUS, (1 - timing.THINNER) * timing.RADIUS))
    # Along a fibre the point keeps its share of the radius.
    assert isinstance(body.fibre, ByCell)
    centres, small_step = body.mesh.points[body.mesh.cells].mean(axis=1), 1e-5
    ahead = centres + small_step * body.fibre.vectors
    shares = [np.linalg.norm(at[:, :2], axis=1) / _radius(at[:, 2]) for at in (centres, ahead)]
    assert shares[0] == pytest.approx(shares[1], abs=1e-9)


def _radius(z: np.ndarray) -> np.ndarray:
    return timing.RADIUS * (1 - timing.THINNER * (2 * z / timing.LENGTH - 1) ** 2)


@pytest.mark.usefixtures("fem_lab")  # it skips where nothing can be solved
def test_names_choose_bodies(tmp_path) -> None:
    case = small.write(tmp_path / "bar")
    one, *others = reference.bodies([f"{case}:10", reference.ALL_FUSIFORM, "fusiform_Q1/P0"], ranks=1)
    assert (one.request, one.repeats) == ({"case": str(case.resolve()), "last": 10, "ranks": 1}, 1)
    assert [(each.name, each.repeats) for each in others] == [(name, 3) for name in reference.FUSIFORM]
    (all_of_it,) = reference.bodies([str(case)], repeats=2)
    assert (all_of_it.request["last"], all_of_it.repeats) == (None, 2)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--reference", "nowhere"], 'got "nowhere"'),
        (["--reference", "hip_flexion:999"], "want a frame above 0, up to 200"),
        (["--reference", "hip_flexion", "--repeats", "0"], "--repeats: got 0, want 1 or more"),
        (["--against", "HEAD"], "--against: got HEAD, want it with --reference only"),
    ],
)
def test_bad_input_is_refused_before_anything_is_timed(words, message, capsys, monkeypatch) -> None:
    monkeypatch.setattr(reference, "_take", None)
    assert cli.main(["benchmark", *words, "--quiet"]) == cli.BAD_INPUT
    assert message in capsys.readouterr().err


@pytest.mark.usefixtures("repository")
@pytest.mark.parametrize("commit", ["no_such_commit", "--all", ""])
def test_a_commit_that_is_not_there_is_refused(commit, capsys, monkeypatch) -> None:
    monkeypatch.setattr(reference, "_take", None)
    assert cli.main(["benchmark", "--reference", f"--against={commit}", "--quiet"]) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert f'--against: got "{commit}"' in said
    assert "want a commit of the repository in" in said


def test_without_git_there_is_no_commit(capsys, monkeypatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert cli.main(["benchmark", "--reference", "--against", "HEAD", "--quiet"]) == cli.BAD_INPUT
    assert '--against: got "HEAD", and no git, want git on the PATH' in capsys.readouterr().err


def test_outside_a_repository_there_is_no_commit(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(checkout, "ROOT", tmp_path)
    assert cli.main(["benchmark", "--reference", "--against", "HEAD", "--quiet"]) == cli.BAD_INPUT
    assert "want a git repository in" in capsys.readouterr().err


@pytest.mark.usefixtures("repository")
def test_the_checkout_is_removed_whatever_happens(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def work() -> float:
        with checkout.checked_out(checkout.find("HEAD")) as root:
            return 1 / (not (root / "fem_reference" / "studies" / "execution.py").exists())

    with pytest.raises(ZeroDivisionError):
        work()
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("repository")
def test_a_commit_that_fails_or_differs_is_refused(monkeypatch, capsys) -> None:
    monkeypatch.setattr(reference, "FUSIFORM", {"tiny": TINY})
    monkeypatch.setattr(reference.fenicsx, "require", lambda _: None)
    command = ["benchmark", "--reference", "tiny", "--against", "HEAD", "--quiet"]

    def fail(*_, **__):
        raise ChildProcessError("exit status 1: ImportError: old")

    def differ(_, root, **__):
        mesh = "now" if root == checkout.ROOT else "then"
        return Taken("converged", "", mesh, 1.0, 1.0, {}), np.zeros((1, 3))

    monkeypatch.setattr(reference, "_take", fail)
    assert cli.main(command) == cli.BAD_INPUT
    assert "where tiny could not be timed (exit status 1: ImportError: old)" in capsys.readouterr().err
    monkeypatch.setattr(reference, "_take", differ)
    assert cli.main(command) == cli.BAD_INPUT
    assert "another mesh or other frames" in capsys.readouterr().err


@pytest.mark.usefixtures("repository", "fem_lab")
def test_a_tiny_body_against_the_last_commit(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(reference, "FUSIFORM", {"tiny": TINY})
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    target = tmp_path / "out" / "speed.json"
    command = ["benchmark", "--reference", "tiny", "--against", "HEAD", "--repeats", "1", "--json", str(target)]
    assert cli.main(command) == cli.DONE
    assert [path.name for path in tmp_path.iterdir()] == ["out"]  # what was checked out is removed
    (body,) = json.loads(target.read_text())["bodies"]
    assert {side: [one["status"] for one in repeats] for side, repeats in body["sides"].items()} == {
        BEFORE: ["converged"],
        NOW: ["converged"],
    }
    assert body["difference_mm"] < 1e-6
    assert {"seconds_wall", "seconds_processor", "seconds_solve", "newton_iterations"} <= set(body["ratios"])
    written = capsys.readouterr()
    assert "tiny: now, repeat 1 of 1" in written.err
    phases = [name.removeprefix("seconds_") for name in body["sides"][NOW][0] if name.startswith("seconds_")]
    assert all(f"  {phase} [s]" in written.out for phase in phases)
