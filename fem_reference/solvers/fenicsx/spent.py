"""Records of the time spent: seconds by phase, and counts."""

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager


class Spent:
    """``seconds`` of this process by phase, and ``counts`` by name. Time in a nested phase counts for the inner phase only."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.counts: defaultdict[str, float] = defaultdict(float)
        self.within: list[str] = []
        self.since = time.perf_counter()

    @contextmanager
    def on(self, phase: str) -> Iterator[None]:
        """A context in which time counts for ``phase``."""
        self._note()
        self.within.append(phase)
        try:
            yield
        finally:
            self._note()
            self.within.pop()

    def _note(self) -> None:
        now = time.perf_counter()
        if self.within:
            self.seconds[self.within[-1]] += now - self.since
        self.since = now
