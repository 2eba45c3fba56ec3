"""The verb ``fetch-anatomy``: what it prints of what was found, by a list of the test's own."""

import hashlib
import json
from pathlib import Path

import pytest

from fem_reference import cli
from fem_reference.studies import fetching
from fem_reference.studies.fetching import Listed


@pytest.fixture
def given(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A download with one file of two that are published, and none of the two that are made."""
    one, two = ((1, hashlib.sha256(text).hexdigest()) for text in (b"1", b"2"))
    listed = Listed(licence="for no trade", published={"box/a": one, "box/b": two}, made={"hip/c": two, "hip/d": two})
    monkeypatch.setattr(fetching, "known", lambda: listed)
    (tmp_path / "given").mkdir()
    (tmp_path / "given" / "else").write_bytes(b"1")
    return tmp_path / "given"


def test_what_is_missing_and_what_can_be_solved_is_said(given: Path, tmp_path: Path, capsys) -> None:
    to, facts = tmp_path / "my data", tmp_path / "facts.json"
    assert cli.main(["fetch-anatomy", str(given), "--to", str(to), "--json", str(facts)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        f"{to}: 1 of 4 files found, by their content",
        "missing files that are published in this form: box/b",
        "missing files that were cleaned, converted or computed, not published: 2 in hip",
        "cases that can be solved with them: none",
        "licence: for no trade",
        f"export FEM_REFERENCE_DATA='{to}'",
    ]
    assert json.loads(facts.read_text()) == {
        "folder": str(to), "found": ["box/a"], "missing": ["box/b", "hip/c", "hip/d"], "cases": [],
    }  # fmt: skip


def test_nothing_that_is_known_is_bad_input(given: Path, tmp_path: Path, capsys) -> None:
    (given / "else").write_bytes(b"3")
    assert cli.main(["fetch-anatomy", str(given), "--to", str(tmp_path / "to")]) == 2
    assert "given: got none of the 4 known files, want an undamaged folder or archive" in capsys.readouterr().err
    assert not (tmp_path / "to").exists()
