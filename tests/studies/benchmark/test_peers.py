"""The reference against its peers: that they solve the same, what the table makes of timings, and what is refused."""

import json
import math

import numpy as np
import pytest

from fem_reference import cli
from fem_reference.studies.benchmark import against_peers, peer_problem, peer_program, peer_table, peers, timing
from fem_reference.studies.benchmark.against_peers import Comparison, Taken

TINY = {"Q1/P0": ("Q1/P0", 1, 5), "P2/P0": ("P2/P0", 1, 4)}
FOREIGN = [name for name in peers.names() if name != peers.OURS]


def taken(wall: float, *, converged: bool = True) -> Taken:
    return Taken(converged, "" if converged else "frame 3: no progress", 40, 7000, wall, wall / 2)


@pytest.fixture
def compared() -> Comparison:
    """Three repeats, of which one met a busy machine, and a peer that ends 3e-9 mm away; another is not installed."""
    ours, theirs = (2.0, 2.5, 4.0), (6.0, 5.0, 6.0)
    times = {peers.OURS: tuple(map(taken, ours)), "felupe": tuple(map(taken, theirs))}
    positions = {peers.OURS: np.zeros((5, 3)), "felupe": np.full((5, 3), 3e-9 / math.sqrt(3))}
    return Comparison("Q1/P0", 1234, times, positions, {"sfepy": "sfepy not installed"})


def test_ratios_are_of_neighbouring_repeats(compared) -> None:
    found = compared.ratio("felupe", "wall")
    assert (found.median, found.minimum, found.maximum) == (2.0, 1.5, 3.0)
    assert compared.median("felupe", "processor") == 3.0
    assert compared.difference("felupe") == pytest.approx(3e-9)


def test_the_table_has_what_was_measured_and_what_was_left_out(compared) -> None:
    text = peer_table.text([compared])
    assert "stretched 10 % and turned by 60 degrees" in text
    assert "wall 2.00 (1.50 to 3.00), processor 2.00 (1.50 to 3.00); ends 3e-09 mm away at most" in text
    assert "  sfepy: left out, sfepy not installed" in text
    assert all(peers.find(name).TUNED in text for name in peers.names())
    (body,) = peer_table.facts([compared])["bodies"]
    assert body["times_as_long"]["felupe"]["wall"]["median"] == 2.0
    assert [one["wall"] for one in body["taken"]["felupe"]] == [6.0, 5.0, 6.0]
    json.dumps(peer_table.facts([compared]), allow_nan=False)


def test_what_failed_is_not_compared(compared) -> None:
    failed = compared.taken | {"felupe": (taken(6.0), taken(9.0, converged=False), taken(6.0))}
    made = Comparison("Q1/P0", 1234, failed, compared.positions, {})
    assert (made.ratio("felupe", "wall"), made.difference("felupe")) == (None, None)
    assert "did not converge: frame 3: no progress" in peer_table.text([made])
    alone = Comparison("Q1/P0", 1234, {"felupe": (taken(1.0),)}, {}, {peers.OURS: "not installed"})
    assert alone.ratio("felupe", "wall") is None
    json.dumps(peer_table.facts([made, alone]), allow_nan=False)


@pytest.mark.parametrize("name", FOREIGN)
def test_a_peer_that_is_not_there_is_left_out(name, monkeypatch) -> None:
    monkeypatch.setattr(peers, "versions", lambda peer: {peer: None})
    assert peers.missing(name) == f"{name} not installed"
    (found,) = against_peers.measure([("Q1/P0", 1, 4)], 1)
    assert (found.taken, set(found.left_out)) == ({}, set(peers.names()))


def test_the_problem_is_bent_and_stretched() -> None:
    bend, last = peer_problem.Bend(), float(peer_problem.FRAMES)
    top = np.array([[0, 0, timing.LENGTH], [1, 0, timing.LENGTH], [0, 1, timing.LENGTH]], float)
    centre, along_x, along_y = top + bend(top, last)
    turned = [math.cos(peer_problem.ANGLE), 0, -math.sin(peer_problem.ANGLE)]
    assert along_x - centre == pytest.approx(turned)
    assert along_y - centre == pytest.approx([0, 1, 0])
    middle = np.zeros((2001, 3))
    middle[:, 2] = np.linspace(0, timing.LENGTH, 2001)
    arc = np.linalg.norm(np.diff(middle + bend(middle, last), axis=0), axis=1).sum()
    assert arc == pytest.approx((1 + peer_problem.STRETCH) * timing.LENGTH, rel=1e-6)
    assert bend(middle, 0.0) == pytest.approx(np.zeros_like(middle))
    assert bend(middle[:1], last) == pytest.approx(np.zeros((1, 3)), abs=1e-12)


def test_the_law_of_peers_is_that_of_the_effect() -> None:
    from fem_reference.effects import State, make

    parameters = timing.EFFECTS["fibre_passive_febio"]
    effect, h = make("fibre_passive_febio", **parameters), 1e-6
    law = {name: value for name, value, _ in effect.parameters}

    def energy(stretch: float) -> float:
        across = stretch**-0.5
        return effect.energy(State(F=np.diag([across, across, stretch]).tolist(), fibre=(0.0, 0.0, 1.0)))

    for stretch in (0.9, 1.1, 1.25, 1.4):
        force, slope = peer_problem.tension(law, np.array(stretch))
        assert force == pytest.approx(
            stretch * (energy(stretch + h) - energy(stretch - h)) / (2 * h), rel=1e-6, abs=1e-12
        )
        around = [peer_problem.tension(law, np.array(stretch + side * h))[0] for side in (-1, 1)]
        assert slope == pytest.approx((around[1] - around[0]) / (2 * h), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("words", [["hip_flexion"], ["--reference"], ["--ranks", "2"], ["--against", "HEAD"]])
def test_nothing_else_is_asked_for_with_peers(words, capsys) -> None:
    assert cli.main(["benchmark", "--peers", *words, "--quiet"]) == cli.BAD_INPUT
    assert "--peers: got" in capsys.readouterr().err


def test_processor_time_counts_and_grows() -> None:
    before = peer_program.processor()
    sum(i * i for i in range(300_000))
    assert peer_program.processor() > before >= 0


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")  # it skips where the reference cannot solve
@pytest.mark.parametrize("element", list(TINY))
@pytest.mark.parametrize("name", FOREIGN)
def test_peers_solve_the_same(name, element) -> None:
    if (why := peers.find(name).OMITTED.get(element) or peers.missing(name)) is not None:
        pytest.skip(why)
    ends = {}
    for who in (peers.OURS, name):
        with peers.find(who).opened() as solve:
            found = solve(peer_problem.muscle(*TINY[element], frames=2))
        assert found.converged, found.message
        ends[who] = found.positions
    assert ends[name] == pytest.approx(ends[peers.OURS], abs=1e-6)


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")
def test_what_is_installed_is_timed(monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.setattr(against_peers, "BODIES", (TINY["Q1/P0"],))
    target = tmp_path / "speed.json"
    assert cli.main(["benchmark", "--peers", "--repeats", "1", "--json", str(target)]) == cli.DONE
    (body,) = json.loads(target.read_text())["bodies"]
    assert set(body["taken"]) | set(body["left_out"]) == set(peers.names())
    assert body["taken"][peers.OURS][0]["processor"] > 0
    for name, off in body["difference_mm"].items():
        assert off < 1e-6, name
    assert "one thread each" in capsys.readouterr().out
