"""Fixtures that several test files share."""

import gc
import importlib.util
import os
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import h5py  # noqa: F401 - before DOLFINx, whose HDF5 it would take for its own
import numpy as np
import pytest

collect_ignore = ["foreign_solver.py", "run_notebook.py"]  # programs: they run where they are imported
# Of these files each test takes long, and only those of one parameter have something in common, a case or the first word of an
# entry, whose bodies have the same compiled forms; the tests of any other file share its fixtures.
SINGLE = {"test_every_case.py": "]", "test_every_entry.py": "_"}


def pytest_configure() -> None:
    """Each of the processes that share the tests keeps to a core of its own, and so do the solvers that it starts."""
    gc.disable()  # to the end of the collection, of which hardly anything can be freed
    worker = os.environ.get("PYTEST_XDIST_WORKER")  # gw0, gw1, ...
    if worker is not None:
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[int(worker.removeprefix("gw")) % len(cores)]})
    # For the processes started from here: OpenBLAS counts cores before they keep to one, and its threads wait by keeping it busy.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Where processes share the tests, those that take long come first, so that none is left to one process at the end."""
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: (item.path.name not in SINGLE, item.get_closest_marker("slow") is None))


def pytest_collection_finish() -> None:
    """What was imported and collected stays to the end: nothing of it is looked at again for what can be freed."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Processes that share the tests take whole files, of ``SINGLE`` what has one parameter, in the order of the collection."""
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file, _, test = nodeid.partition("::")
            end = SINGLE.get(Path(file).name)
            if end is None:
                return file
            return file + (test[test.find("[") :].split(end)[0] if "[" in test else test)

    config.option.loadscopereorder = False
    return ByFile(config, log)


@pytest.fixture(scope="module")
def all_cores() -> Iterator[None]:
    """Of this process and what it starts: MPI processes that share a core wait for each other by keeping it busy."""
    own = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    yield
    os.sched_setaffinity(0, own)


@pytest.fixture(scope="session", autouse=True)
def _one_process_of_fenicsx() -> Iterator[None]:
    """What is solved on one rank is solved in one process, started when the first test needs it: as error bars are."""
    from fem_reference.solvers import fenicsx

    with fenicsx.shared():
        yield


@pytest.fixture(scope="session", autouse=True)
def _each_mesh_is_made_once() -> Iterator[None]:
    """Muscles with the same surface, attachments and size have one mesh; the mesher itself is tested where it is imported."""
    from fem_reference.foundations.mesh import fingerprint
    from fem_reference.problems import muscle

    made: dict[str, Any] = {}
    mesher = muscle.tetrahedralise

    def tetrahedralise(surface: Any, size: float, shares: dict[str, Any]) -> Any:
        key = repr((list(shares), size, fingerprint(surface.points, surface.triangles, *shares.values())))
        if key not in made:
            made[key] = mesher(surface, size, shares)
        return made[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(muscle, "tetrahedralise", tetrahedralise)
        patch.setattr(muscle, "kept_meshes", lambda: None)  # what a test changes of the mesher is kept nowhere
        yield


@pytest.fixture(scope="session", autouse=True)
def _distances_to_a_bone_are_read_once() -> Iterator[None]:
    """Those of the last few bones stay in memory: what is stored of them is tested where it is stored, and elsewhere the same."""
    from fem_reference.foundations.mesh import fingerprint
    from fem_reference.problems import setup

    read: dict[tuple[str, Path], Any] = {}
    stored = setup.cached

    def cached(surface: Any, error: float, margin: float, rounding: float, folder: Path) -> Any:
        key = fingerprint(surface.points, surface.triangles, np.array([error, margin, rounding])), folder
        if key not in read:
            if len(read) == 24:
                read.clear()
            read[key] = stored(surface, error, margin, rounding, folder)
        return read[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(setup, "cached", cached)
        yield


@pytest.fixture
def without_curves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages of comparisons are written without their curves, which take half of the time."""
    from fem_reference.report import comparison_page

    def curves(_: Any) -> tuple[()]:
        return ()

    monkeypatch.setattr(comparison_page, "curves", curves)


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages are written as where nothing can draw."""
    from undrawn import undraw

    from fem_reference.report import gallery

    monkeypatch.setattr(gallery, "program", gallery.program)  # restored after the test
    undraw()


@pytest.fixture
def without_pictures(undrawn: None, without_curves: None) -> None:
    """Pages are written as where nothing can draw, and without curves."""


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of the report's own data, which is licensed apart from this project."""
    folder = os.environ.get("FEM_REFERENCE_DATA")
    if not folder:
        pytest.skip("the report's data is not here: FEM_REFERENCE_DATA is not set")
    return Path(folder)


@pytest.fixture(scope="session")
def fem_lab():
    """Where entries of the catalogue are measured."""
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    from fem_reference.verification.lab import lab

    with lab() as opened:
        yield opened


def pytest_addoption(parser: pytest.Parser) -> None:
    """An option under which a skipped test or file is a failure, as for the extras."""
    parser.addoption("--none-skipped", action="store_true", help="a skipped test fails, with its reason")


def _refuse_skip(report: pytest.TestReport | pytest.CollectReport, config: pytest.Config) -> None:
    """Turn a skipped ``report`` into a failed one under ``--none-skipped``; an expected failure stays."""
    if config.getoption("--none-skipped") and report.skipped and not hasattr(report, "wasxfail"):
        why = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        report.outcome, report.longrepr = "failed", f"none may be skipped here: {why}"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Refuse a skipped test."""
    report = yield
    _refuse_skip(report, item.config)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Refuse a skipped file."""
    report = yield
    _refuse_skip(report, collector.config)
    return report
