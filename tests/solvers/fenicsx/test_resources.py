"""What a solution takes is known before it is taken, and what the machine has is what the system says."""

import importlib.util
import os
import threading
import time

import pytest

from fem_reference.effects import make
from fem_reference.foundations.errors import InputError
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import BodySettings, Settings, resources
from fem_reference.verification.parts import resistance

pytestmark = pytest.mark.slow


def box(element: str, counts=(2, 3, 4)):
    return shapes.box(counts, (1.0, 1.0, 1.0), ELEMENTS[element][0])


@pytest.mark.parametrize("element", ["P1", "P1/P1", "P2", "P2/P0", "P2/P1"])
def test_unknowns_are_counted_as_the_solver_counts_them(element) -> None:
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    acting = (make("neo_hooke", mu="10 kPa"), resistance(element, 1.0))
    body = Body(box(element), acting, (Prescribed("z0", "z0", (0, 1, 2), Rest()),), (0.0, 1.0))
    solved = fenicsx.solve_body(body, BodySettings(element=element))
    assert resources.unknowns(body.mesh, element) == solved.outcome.cost["unknowns"]


def test_the_solver_follows_the_size_and_the_memory(monkeypatch) -> None:
    mesh = box("P2/P1", (8, 8, 8))

    def chosen(free: float) -> str | None:
        return resources.planned(BodySettings(), mesh, free).linear_solver

    count = resources.unknowns(mesh, "P2/P1")
    assert chosen(1e6) == "lagged"
    # As of a body whose factors are larger than all else: where only multigrid fits, it is taken.
    monkeypatch.setattr(resources, "unknowns", lambda *_: 300_000)
    needed = {kind: resources.memory(300_000, kind, "single") for kind in ("multigrid", "lagged")}
    assert needed["multigrid"] < needed["lagged"]
    assert [chosen(1.01 * needed[kind]) for kind in ("multigrid", "lagged")] == ["multigrid", "lagged"]
    monkeypatch.setattr(resources, "unknowns", lambda *_: resources.LARGE + count)
    assert chosen(1e6) == "multigrid"
    monkeypatch.setattr(resources, "unknowns", lambda *_: resources.SMALL - 1)
    assert resources.planned(BodySettings(), mesh, 1e6).precision == "double"


def test_too_little_memory_is_refused_before_it_is_taken() -> None:
    with pytest.raises(
        InputError, match=r"memory: got \d+ MB for \d+ unknowns \(multigrid\), want at most the 100 MB of free memory"
    ):
        resources.planned(BodySettings(), box("P2/P1", (6, 6, 6)), 100.0)
    with pytest.raises(InputError, match=r"\(lagged\)"):
        resources.planned(BodySettings(linear_solver="lagged"), box("P2/P1"), 100.0)


def test_what_is_asked_for_is_taken() -> None:
    asked = Settings(linear_solver="direct", precision="single", ranks=3)
    assert resources.planned(asked, box("P2/P1", (6, 6, 6)), 1e6) == asked


def test_the_memory_grows_with_the_size_and_factors_faster_than_all_else() -> None:
    assert resources.memory(200_000, "lagged", "double") > resources.memory(200_000, "lagged", "single")
    ratios = [
        resources.memory(10**6, kind, "single") / resources.memory(10**5, kind, "single")
        for kind in ("lagged", "multigrid")
    ]
    assert 10 < ratios[0] < 25
    assert 5 < ratios[1] < 10


def test_a_busy_core_is_not_idle() -> None:
    # All cores that this process may use are kept busy by threads that hold no lock for long.
    stop = time.monotonic() + 1.5
    cores = len(os.sched_getaffinity(0))

    def spin() -> None:
        while time.monotonic() < stop:
            sum(range(1000))

    before = resources.idle_cores()
    threads = [threading.Thread(target=spin) for _ in range(cores)]
    for thread in threads:
        thread.start()
    found = resources.idle_cores()
    for thread in threads:
        thread.join()
    assert 0 <= found <= cores
    assert found <= max(before, cores - 1)


def test_ranks_follow_size_and_free_cores(monkeypatch) -> None:
    monkeypatch.setattr(resources, "idle_cores", lambda: 2)
    assert resources.ranks(Settings(linear_solver="lagged"), 10**6) == 2
    assert resources.ranks(Settings(linear_solver="lagged"), 1000) == 1
    assert resources.ranks(Settings(linear_solver="multigrid"), 10**6) == 1
    monkeypatch.setattr(resources, "idle_cores", lambda: 1)
    assert resources.ranks(Settings(linear_solver="lagged"), 10**6) == 1
