"""The verb ``check`` on one of several muscles: each has a baseline and frames of its own, and the reference is that of all."""

import json
from pathlib import Path

import pytest
import two_bars

from fem_reference import cli
from fem_reference.io import files
from fem_reference.scenes import casefile
from fem_reference.studies.execution import Bench

pytestmark = pytest.mark.slow


class Work:
    """The scene of two bars in ``folder``, with frames of both in a folder each, which follow the reference but for ``more``."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.case = folder, casefile.read(folder)
        self.problem = Bench(self.case, folder / "reports" / "runs").problem()

    def write(self, more: float = 0.0) -> None:
        counts = [len(one.mesh.tets) for one in self.problem.problems.values()]
        for name, grows in zip(two_bars.SIZES, (counts, counts[::-1]), strict=True):
            surface = self.problem.problems[name].surface
            (self.folder / "mine" / name).mkdir(parents=True, exist_ok=True)
            for number in self.case.numbers:
                points = surface.points * (1 + number * (two_bars.growth(*grows) + more))
                files.write_surface(self.folder / "mine" / name / f"frame_{number:04d}.vtp", surface, points)

    def check(self, muscle: str, *words: str, to: str = "") -> int:
        given = ["--candidate", str(self.folder / "mine"), "--baseline", str(self.folder / f"{to or muscle}.json")]
        given += ["--out", str(self.folder / "reports"), "--quiet", *(["--muscle", muscle] if muscle else [])]
        return cli.main(["check", str(self.folder), *given, *words])


@pytest.fixture
def work(tmp_path, monkeypatch) -> Work:
    work = Work(two_bars.write(tmp_path / "two", monkeypatch))
    work.write()
    return work


def test_a_muscle_passes_as_it_was_and_fails_once_it_moves_otherwise(work, capsys) -> None:
    for name in two_bars.SIZES:
        assert work.check(name, "--update", "--error-bar") == cli.DONE
        table = json.loads((work.folder / f"{name}.json").read_text())
        assert table["case"] == f"two_{name}"
        # The frames are those of this muscle's part of the reference, but for the give of contact.
        rms = table["measures"]["surface_deviation.rms"]
        assert 0 < max(rms["values"]) < rms["within"]
    work.write(1e-3)
    capsys.readouterr()
    assert work.check("thin") == cli.VERDICT_FAIL
    failed = capsys.readouterr().out
    assert "fail: surface_deviation.p95 within at frame 20" in failed
    assert "verdict: fail" in failed


def test_a_baseline_of_another_muscle_is_refused(work, capsys) -> None:
    assert work.check("thin", "--update") == cli.DONE
    assert work.check("wide", to="thin") == cli.BAD_INPUT
    assert "two_thin" in capsys.readouterr().err


def test_what_changed_in_a_neighbour_is_reported(work, capsys) -> None:
    assert work.check("thin", "--update") == cli.DONE
    assert "the reference of the baseline was" not in capsys.readouterr().out
    assert work.check("thin", "--set", "muscle[0].tet_size=4 mm") in (cli.DONE, cli.VERDICT_FAIL)
    assert "the reference of the baseline was fenicsx-" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("muscle", "lost", "wanted"),
    [
        ("", "", '--muscle: got "", want one of wide, thin'),
        ("flat", "", '--muscle: got "flat", want one of wide, thin'),
        ("thin", "thin", 'without frames of the muscle, want a folder "thin" in it'),
    ],
)
def test_bad_input_is_named_before_anything_is_solved(muscle, lost, wanted, work, capsys) -> None:
    if lost:
        (work.folder / "mine" / lost).rename(work.folder / "elsewhere")
    assert work.check(muscle, "--update", to="some") == cli.BAD_INPUT
    assert wanted in capsys.readouterr().err
    assert not list((work.folder / "reports" / "runs").glob("fenicsx-*"))
