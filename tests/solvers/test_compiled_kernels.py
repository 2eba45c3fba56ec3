"""Where machine code is kept, and that loops compile where it cannot be."""

import pytest

from fem_reference.solvers import compiled_kernels as kernels


def double(value: float) -> float:
    return 2 * value


@pytest.fixture(autouse=True)
def _fresh():
    """What is remembered of folders is forgotten, before and after."""
    kernels.kept_code.cache_clear()
    kernels.can_keep.cache_clear()
    yield
    kernels.kept_code.cache_clear()
    kernels.can_keep.cache_clear()


def test_code_is_kept_below_the_users_cache(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert kernels.compiled(double)(1.5) == 3
    assert list((tmp_path / "cache" / "fem_reference" / "compiled").rglob("*.nbc"))


def test_where_no_folder_can_be_made_loops_compile_all_the_same(tmp_path, monkeypatch) -> None:
    file = tmp_path / "file"
    file.write_text("a file is no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(file))
    assert kernels.compiled(double)(1.5) == 3
    assert not kernels.can_keep(kernels.kept_code())


def test_without_a_home_nothing_is_written_where_the_user_is(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", "~nobody/.cache")
    assert kernels.compiled(double)(1.5) == 3
    assert not list(tmp_path.iterdir())
