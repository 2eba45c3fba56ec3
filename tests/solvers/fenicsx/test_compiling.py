"""What an interrupted compilation leaves behind does not stop the next one."""

import os
import signal
import time

import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.solvers.fenicsx import compiling


def test_only_what_was_left_half_done_long_ago_goes(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(compiling.jit, "get_options", lambda: {"cache_dir": str(tmp_path)})
    handlers = {}
    monkeypatch.setattr(compiling.signal, "signal", handlers.__setitem__)
    long_ago = time.time() - 2 * compiling.PATIENCE
    done = ["done.c", "done.c.cached", "done.cpython-312.so"]
    for name in (*done, "left.c", "unfinished.c", "source_went.c.cached", "library_went.c", "library_went.c.cached"):
        (tmp_path / name).write_text("")
    for name in ("done.c", "left.c"):
        os.utime(tmp_path / name, (long_ago, long_ago))
    compiling.prepare()
    assert sorted(path.name for path in tmp_path.iterdir()) == [*done, "unfinished.c"]
    assert handlers[signal.SIGINT] is signal.SIG_IGN
    with pytest.raises(RuntimeError, match="asked to stop"):  # FFCx cleans up after an Exception
        handlers[signal.SIGTERM](signal.SIGTERM, None)


def test_what_looks_half_done_stays_while_something_is_compiled(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(compiling.jit, "get_options", lambda: {"cache_dir": str(tmp_path)})
    monkeypatch.setattr(compiling.signal, "signal", lambda *_: None)
    (tmp_path / "slow.c").write_text("")
    os.utime(tmp_path / "slow.c", (1.0, 1.0))
    with compiling.lock(tmp_path, 3):
        compiling.prepare()
        assert (tmp_path / "slow.c").exists()
    compiling.prepare()
    assert not (tmp_path / "slow.c").exists()


def test_without_a_cache_there_is_nothing_to_clean(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(compiling.jit, "get_options", lambda: {"cache_dir": str(tmp_path / "none")})
    monkeypatch.setattr(compiling.signal, "signal", lambda *_: None)
    compiling.prepare()
    assert not (tmp_path / "none").exists()
