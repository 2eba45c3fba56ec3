"""Finds the entries of the catalogue and measures them."""

import importlib
import logging
import math
import os
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from difflib import get_close_matches
from fnmatch import fnmatchcase
from itertools import count
from types import ModuleType

from fem_reference import verification
from fem_reference.assessment.catalogue import Entry, Finding, Lab, Result, result
from fem_reference.foundations import modules
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.threads import in_threads

log = logging.getLogger(__name__)

# The time [s] within which a signal to all processes, after it has ended the process of a lab, reaches this process too.
HEARD = 0.5
# Errors that make one entry fail while the other entries go on. Any other error is a bug in this package, or an interrupt.
FAILURES = (InputError, ValueError, ArithmeticError, LookupError, RuntimeError, OSError)


def entries() -> dict[str, Entry]:
    """The catalogue: every entry by its name, in the order of the files and of the ``ENTRIES`` in each."""
    names = modules.names(verification.__path__)
    return collect(importlib.import_module(f"{verification.__name__}.{name}") for name in names)


def collect(modules: Iterable[ModuleType]) -> dict[str, Entry]:
    """The ``ENTRIES`` of ``modules`` by their names; a module without ``ENTRIES`` contributes none."""
    found: dict[str, Entry] = {}
    for module in modules:
        for entry in getattr(module, "ENTRIES", ()):
            if entry.name in found:
                raise ValueError(f'{module.__name__}: a second entry "{entry.name}"')
            found[entry.name] = entry
    return found


def choose(catalogue: dict[str, Entry], wanted: Iterable[str], place: str) -> tuple[str, ...]:
    """The names of the entries that ``wanted`` selects, in the order of the catalogue. ``wanted``: names of entries or groups, or
    shell patterns. Raises InputError naming ``place`` if one of them matches nothing.
    """
    chosen: set[str] = set()
    for text in wanted:
        meant = {name for name, entry in catalogue.items() if fnmatchcase(name, text) or fnmatchcase(entry.group, text)}
        if not meant:
            raise InputError(place, f'"{text}"', _known(catalogue, text))
        chosen |= meant
    return tuple(name for name in catalogue if name in chosen)


def _known(catalogue: dict[str, Entry], text: str) -> str:
    """The entries that ``text`` may have meant: the names closest to it, and every group."""
    groups = dict.fromkeys(entry.group for entry in catalogue.values())
    near = get_close_matches(text, catalogue, n=5)
    such = f" (such as {', '.join(near)})" if near else ""
    return f"an entry{such}, a group ({', '.join(groups)}) or a pattern of them"


def run(
    wanted: Sequence[Entry],
    make_lab: Callable[[], AbstractContextManager[Lab]],
    with_negative_control: frozenset[str] = frozenset(),
) -> tuple[Result, ...]:
    """The results of the ``wanted`` entries, in this order. Entries named in ``with_negative_control`` are measured with their
    negative control.

    Two entries run at a time if there are two cores, each in a thread with its own lab. The labs are closed even after an error. An
    entry whose lab is ended by an interrupt or an error has no result.
    """
    ended = threading.Event()
    begin, reporting, done = time.perf_counter(), threading.Lock(), count(1)

    def work(entry: Entry, lab: Lab) -> Result:
        last = _measured(entry, lab, with_negative_control=entry.name in with_negative_control)
        passed = time.perf_counter() - begin
        if math.isfinite(last.finding.value) or not ended.wait(HEARD):
            with reporting:
                _log_progress(last, next(done), len(wanted), passed)
        return last

    labs = min(2, len(os.sched_getaffinity(0)), len(wanted))
    return in_threads(work, wanted, labs * [make_lab], ended.set)


def _measured(entry: Entry, lab: Lab, *, with_negative_control: bool) -> Result:
    """The result of an entry; after an error, its value or truth is NaN and its note states the error."""
    begin = time.perf_counter()
    try:
        finding = entry.find(lab, with_negative_control=with_negative_control)
    except FAILURES as error:
        finding = Finding(math.nan, note=f"{type(error).__name__}: {error}")
    seconds = time.perf_counter() - begin
    try:
        return result(entry, finding, seconds, with_negative_control=with_negative_control)
    except FAILURES as error:
        notes = [finding.note, f"no truth, {type(error).__name__}: {error}"]
        explained = replace(finding, note="; ".join(filter(None, notes)))
        return Result(entry, explained, math.nan, math.nan, seconds, with_negative_control)


def _log_progress(last: Result, done: int, wanted: int, passed: float) -> None:
    left = f", about {passed / done * (wanted - done):.0f} s left" if done < wanted else ""
    log.info("verify: %d of %d, %s %s, %.0f s%s", done, wanted, last.entry.name, last.word, passed, left)
