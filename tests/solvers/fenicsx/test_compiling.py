"""Compilation leaves a process that is asked to stop the time to clean up, and searches no incomplete files."""

import signal
from importlib.machinery import EXTENSION_SUFFIXES

import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.solvers.fenicsx import compiling

COMPLETE = ["form.c", "form.c.cached", f"form{EXTENSION_SUFFIXES[0]}"]


def test_a_process_that_is_asked_to_stop_raises(monkeypatch) -> None:
    handlers = {}
    monkeypatch.setattr(compiling.signal, "signal", handlers.__setitem__)
    compiling.prepare()
    assert handlers[signal.SIGINT] is signal.SIG_IGN
    with pytest.raises(RuntimeError, match="asked to stop"):  # FFCx cleans up after an Exception
        handlers[signal.SIGTERM](signal.SIGTERM, None)


@pytest.mark.parametrize("missing", [None, *COMPLETE])
def test_a_form_without_one_of_its_files_is_compiled_again(missing, tmp_path) -> None:
    for name in (*COMPLETE, "format.c"):
        (tmp_path / name).write_text("")
    if missing is not None:
        (tmp_path / missing).unlink()

    def search(*_) -> list[str]:
        return sorted(path.name for path in tmp_path.iterdir())

    left = COMPLETE if missing is None else []
    assert compiling._complete(search)("form", [], tmp_path, 1) == sorted([*left, "format.c"])
