"""The reference against its peers: that they solve the same, what the table makes of timings, and what is refused."""

import json
import math

import numpy as np
import pytest

from benchmarks import bodies, peers
from benchmarks.peers import __main__ as program
from benchmarks.peers import problem
from benchmarks.peers.__main__ import Compared, Taken

TINY = {"Q1/P0": ("Q1/P0", 1, 5), "P2/P0": ("P2/P0", 1, 4)}
FOREIGN = [name for name in peers.NAMES if name != peers.OURS]


def taken(wall: float, *, converged: bool = True) -> Taken:
    return Taken(converged, "" if converged else "frame 3: no progress", 40, 7000, wall, wall / 2)


@pytest.fixture
def compared() -> Compared:
    """Three repeats, of which one met a busy machine, and a peer that ends 3e-9 mm away; another is not installed."""
    ours, theirs = (2.0, 2.5, 4.0), (6.0, 5.0, 6.0)
    times = {peers.OURS: [*map(taken, ours)], "felupe": [*map(taken, theirs)]}
    positions = {peers.OURS: np.zeros((5, 3)), "felupe": np.full((5, 3), 3e-9 / math.sqrt(3))}
    return Compared("Q1/P0", 1234, times, positions, {"sfepy": "sfepy not installed"})


def test_ratios_are_of_neighbouring_repeats(compared) -> None:
    assert compared.ratio("felupe", "wall") == {"median": 2.0, "minimum": 1.5, "maximum": 3.0}
    assert compared.difference("felupe") == pytest.approx(3e-9)


def test_the_table_has_what_was_measured_and_what_was_left_out(compared) -> None:
    text = program.text([compared])
    assert "stretched 10 % and turned by 60 degrees" in text
    assert "wall 2.00 (1.50 to 3.00), processor 2.00 (1.50 to 3.00); ends 3e-09 mm away at most" in text
    assert "  sfepy: left out, sfepy not installed" in text
    assert all(peers.find(name).TUNED in text for name in peers.NAMES)
    (body,) = program.facts([compared])["bodies"]
    assert body["times_as_long"]["felupe"]["wall"]["median"] == 2.0
    assert [one["wall"] for one in body["taken"]["felupe"]] == [6.0, 5.0, 6.0]
    json.dumps(program.facts([compared]), allow_nan=False)


def test_what_failed_is_not_compared(compared) -> None:
    failed = compared.taken | {"felupe": [taken(6.0), taken(9.0, converged=False), taken(6.0)]}
    made = Compared("Q1/P0", 1234, failed, compared.positions, {})
    assert (made.ratio("felupe", "wall"), made.difference("felupe")) == (None, None)
    assert "did not converge: frame 3: no progress" in program.text([made])
    alone = Compared("Q1/P0", 1234, {"felupe": [taken(1.0)]}, {}, {peers.OURS: "not installed"})
    assert alone.ratio("felupe", "wall") is None
    json.dumps(program.facts([made, alone]), allow_nan=False)


@pytest.mark.parametrize("name", FOREIGN)
def test_a_peer_that_is_not_there_is_left_out(name, monkeypatch) -> None:
    monkeypatch.setattr(peers, "versions", lambda peer: {peer: None})
    assert peers.missing(name) == f"{name} not installed"
    found = program.compare(("Q1/P0", 1, 4), 1)
    assert (found.taken, set(found.left_out)) == ({}, set(peers.NAMES))


def test_the_problem_is_bent_and_stretched() -> None:
    bend, last = problem.Bend(), float(problem.FRAMES)
    top = np.array([[0, 0, bodies.LENGTH], [1, 0, bodies.LENGTH], [0, 1, bodies.LENGTH]], float)
    centre, along_x, along_y = top + bend(top, last)
    turned = [math.cos(problem.ANGLE), 0, -math.sin(problem.ANGLE)]
    assert along_x - centre == pytest.approx(turned)
    assert along_y - centre == pytest.approx([0, 1, 0])
    middle = np.zeros((2001, 3))
    middle[:, 2] = np.linspace(0, bodies.LENGTH, 2001)
    arc = np.linalg.norm(np.diff(middle + bend(middle, last), axis=0), axis=1).sum()
    assert arc == pytest.approx((1 + problem.STRETCH) * bodies.LENGTH, rel=1e-6)
    assert bend(middle, 0.0) == pytest.approx(np.zeros_like(middle))
    assert bend(middle[:1], last) == pytest.approx(np.zeros((1, 3)), abs=1e-12)


def test_the_law_of_peers_is_that_of_the_effect() -> None:
    from fem_reference.effects import State, make

    parameters = bodies.EFFECTS["fibre_passive_febio"]
    effect, h = make("fibre_passive_febio", **parameters), 1e-6
    law = {name: value for name, value, _ in effect.parameters}

    def energy(stretch: float) -> float:
        across = stretch**-0.5
        return effect.energy(State(F=np.diag([across, across, stretch]).tolist(), fibre=(0.0, 0.0, 1.0)))

    for stretch in (0.9, 1.1, 1.25, 1.4):
        force, slope = problem.tension(law, np.array(stretch))
        assert force == pytest.approx(
            stretch * (energy(stretch + h) - energy(stretch - h)) / (2 * h), rel=1e-6, abs=1e-12
        )
        around = [problem.tension(law, np.array(stretch + side * h))[0] for side in (-1, 1)]
        assert slope == pytest.approx((around[1] - around[0]) / (2 * h), rel=1e-6, abs=1e-12)


def test_one_peer_that_fails_is_no_end_of_the_others(monkeypatch) -> None:
    monkeypatch.setattr(program, "take", None)  # nothing that a process can call
    monkeypatch.setattr(peers, "missing", lambda name: None if name == peers.OURS else "not installed")
    found = program.compare(("Q1/P0", 1, 4), 1)
    assert found.taken == {}
    assert found.left_out[peers.OURS].startswith("failed: ")


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")  # it skips where the reference cannot solve
@pytest.mark.parametrize("element", list(TINY))
@pytest.mark.parametrize("name", FOREIGN)
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # SfePy has old calls of Python and pyparsing
def test_peers_solve_the_same(name, element) -> None:
    if (why := peers.find(name).OMITTED.get(element) or peers.missing(name)) is not None:
        pytest.skip(why)
    ends = {}
    for who in (peers.OURS, name):
        with peers.find(who).opened() as solve:
            found = solve(problem.muscle(*TINY[element], frames=2))
        assert found.converged, found.message
        ends[who] = found.positions
    assert ends[name] == pytest.approx(ends[peers.OURS], abs=1e-6)


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")
def test_what_is_installed_is_timed(monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.setattr(program, "BODIES", (TINY["Q1/P0"],))
    target = tmp_path / "speed.json"
    assert program.main(["--repeats", "1", "--json", str(target)]) == 0
    (body,) = json.loads(target.read_text())["bodies"]
    assert set(body["taken"]) | set(body["left_out"]) == set(peers.NAMES)
    assert body["taken"][peers.OURS][0]["processor"] > 0
    for name, off in body["difference_mm"].items():
        assert off < 1e-6, name
    assert "one thread each" in capsys.readouterr().out
