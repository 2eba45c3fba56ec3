"""Modules in folders: by name, once listed they are listed again only after a change."""

import os

from fem_reference.foundations import modules


def test_a_file_that_was_added_or_removed_is_seen(tmp_path) -> None:
    first, second, nowhere = (tmp_path / name for name in ("first", "second", "nowhere"))
    for folder in (first, second):
        folder.mkdir()
    (first / "b.py").touch()
    (second / "a").mkdir()
    (second / "a" / "__init__.py").touch()
    (second / "notes.txt").touch()
    places = [str(folder) for folder in (first, second, nowhere)]
    assert modules.names(places) == ("a", "b")
    (second / "c.py").touch()
    os.utime(second, ns=(1, 1))  # a clock that may not have gone on since the folder was listed
    assert modules.names(places) == ("a", "b", "c")
    (first / "b.py").unlink()
    os.utime(first, ns=(1, 1))
    assert modules.names(places) == ("a", "c")
