"""Files of C are compiled once, with their flags, and what a compiler says of a wrong one is said."""

import pytest

from fem_reference.foundations import native


def test_a_file_is_compiled_once_for_its_flags_and_its_text(tmp_path, monkeypatch) -> None:
    source, kept = tmp_path / "twice.c", tmp_path / "kept"
    source.write_text("int twice(int a) { return FACTOR * a; }")
    assert native.library(source, ["-DFACTOR=2"], kept).twice(21) == 42
    assert native.library(source, ["-DFACTOR=3"], kept).twice(14) == 42
    assert len(list(kept.iterdir())) == 2
    monkeypatch.setattr(native.subprocess, "run", None)  # nothing is compiled again
    assert native.library(source, ["-DFACTOR=2"], kept).twice(21) == 42
    source.write_text("int twice(int a) { return FACTOR * a + 1; }")
    with pytest.raises(TypeError):
        native.library(source, ["-DFACTOR=2"], kept)


def test_what_cannot_be_compiled_is_an_error_with_what_the_compiler_says(tmp_path, monkeypatch) -> None:
    source = tmp_path / "wrong.c"
    source.write_text("int f(void) { return missing; }")
    with pytest.raises(RuntimeError, match=r"cannot compile .*wrong\.c: [\s\S]*missing"):
        native.library(source, [], tmp_path / "kept")
    assert list((tmp_path / "kept").iterdir()) == []
    monkeypatch.setenv("CC", "/nowhere/cc")
    with pytest.raises(OSError, match="/nowhere/cc"):
        native.library(source, [], tmp_path / "kept")
