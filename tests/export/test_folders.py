"""The folder of an export: refused where it is in use or cannot be, and gone where an export fails."""

from pathlib import Path

import pytest

from fem_reference import export
from fem_reference.foundations.errors import InputError
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers.common import open_formats

pytestmark = pytest.mark.slow


def test_a_folder_that_is_in_use_is_refused_before_any_work(scene: MuscleCase, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("work of months")
    with pytest.raises(InputError, match=r"--to: got .*, which is not empty, want a new or empty folder"):
        export.export(scene, lambda: pytest.fail("built"), tmp_path, "open")
    with pytest.raises(InputError, match=r"--to: got .*mine\.txt\", a file, want a new or empty folder"):
        export.export(scene, lambda: pytest.fail("built"), tmp_path / "mine.txt", "open")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_folder_that_cannot_be_written_shows_before_the_problem_is_built(scene: MuscleCase, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="cannot be written: Not a directory"):
        export.export(scene, lambda: pytest.fail("built"), tmp_path / "file" / "scene", "open")


def test_an_export_that_fails_leaves_nothing(
    scene: MuscleCase, built: MuscleProblem, tmp_path: Path, monkeypatch
) -> None:
    def fails(*_: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(open_formats, "write_lines", fails)
    with pytest.raises(OSError, match="no space left"):
        export.export(scene, lambda: built, tmp_path / "new" / "folders" / "bar", "open")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.undo()
    (tmp_path / "bar").mkdir()  # an empty folder is free
    assert "scene.json" in export.export(scene, lambda: built, tmp_path / "bar", "open")
