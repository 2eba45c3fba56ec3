"""Time spent: a phase within another counts in its own only."""

import pytest

from fem_reference.solvers.fenicsx import spent


def test_a_phase_within_another_counts_in_its_own_only(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = iter([0.0, 1.0, 3.0, 6.0, 10.0])
    monkeypatch.setattr(spent.time, "perf_counter", lambda: next(ticks))
    found = spent.Spent()
    with found.on("assembly"), found.on("contact"):  # from 1 s on, and from 3 to 6 s
        pass
    assert found.seconds == {"assembly": 2 + 4, "contact": 3}


def test_time_is_counted_where_a_phase_fails() -> None:
    found = spent.Spent()
    with pytest.raises(ArithmeticError), found.on("krylov"):
        raise ArithmeticError
    assert set(found.seconds) == {"krylov"}
    assert not found.within
