"""Folders between processes: gone at the end, and those that killed processes left at the next start."""

import os
import time

from fem_reference.foundations import scratch


def test_a_folder_is_gone_at_the_end() -> None:
    with scratch.folder() as mine:
        (mine / "job").write_text("x")
    assert not mine.exists()


def test_only_what_a_killed_process_left_a_while_ago_is_removed(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(scratch.tempfile, "gettempdir", lambda: str(tmp_path))
    now = time.time()
    with scratch.folder() as mine:
        os.utime(mine, (now - 100, now - 100))
        left = tmp_path / "fem_reference_scratch-left"
        left.mkdir()
        (left / ".lock").touch()
        with scratch.folder() as young:
            assert mine.is_dir()
            assert left.is_dir()
            assert young != mine
        os.utime(left, (now - 100, now - 100))
        with scratch.folder():
            assert mine.is_dir()
            assert not left.exists()
