"""Fixtures of the tests of scenes."""

from pathlib import Path

import pytest

from tests.scenes.bars import FILES, SCENE


@pytest.fixture
def bar(tmp_path: Path) -> Path:
    """A scene folder called ``bar`` with its files."""
    folder = tmp_path / "bar"
    folder.mkdir()
    (folder / "case.toml").write_text(SCENE, encoding="utf-8")
    for name in (*FILES, "fibres.vtk", "marks.csv"):
        (folder / name).write_text(f"content of {name}", encoding="utf-8")
    return folder
