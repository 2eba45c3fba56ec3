"""States on disk: a body that takes one up is where the one was that wrote it, bit by bit."""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from tense import in_situ, muscle

from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Rest
from fem_reference.runs.writer import CutOff
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.jobs import kept
from fem_reference.solvers.fenicsx.restart import Restart
from fem_reference.verification import parts

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")]


def body(mu: float = 0.5) -> Body:
    mesh = shapes.box((2, 1, 2), (2.0, 1.0, 1.0), "hexahedron")
    lid = Prescribed("lid", "z1", (0, 1, 2), Affine(((0.0, 0.0, 0.0),) * 3, (0.1, 0.0, 0.2)))
    ground = Prescribed("ground", "z0", (0, 1, 2), Rest())
    return Body(mesh, parts.neo_hooke(mu, 20.0), (ground, lid), (0.0, 1.0))


def test_a_state_is_taken_up_bit_by_bit(tmp_path) -> None:
    settings = BodySettings(element="Q1/P0", first_step=1.0)
    first = AssembledBody(body(), settings)
    assert first.attempt(1.0).converged
    Restart(first, kept(CutOff(tmp_path, ()), body())).write(1, {"size": 1.0})
    again = AssembledBody(body(), settings)
    restart = Restart(again, kept(CutOff(tmp_path, (1,)), body()))
    assert restart.good() == (1,)
    assert restart.go_on((1,))["size"] == 1.0
    assert np.array_equal(again.unknowns.x.array, first.unknowns.x.array)
    assert again.at == 1.0


def test_a_state_out_of_balance_with_other_effects_is_not_gone_on_from(tmp_path) -> None:
    settings = BodySettings(element="Q1/P0", first_step=1.0)
    first = AssembledBody(body(), settings)
    assert first.attempt(1.0).converged
    Restart(first, kept(CutOff(tmp_path, ()), body())).write(1, {"size": 1.0})
    other = AssembledBody(body(mu=0.7), settings)
    restart = Restart(other, kept(CutOff(tmp_path, (1,)), body(mu=0.7)))
    assert restart.good() == ()
    assert not other.unknowns.x.array.any()


def test_a_body_in_situ_goes_on_from_its_tension(tmp_path) -> None:
    """The stress at rest, which is in no file, is found again."""
    settings = BodySettings(element="P2/P1", first_step=1.0)
    pull = Affine(((0.0, 0.0, 0.0),) * 3, (0.5, 0.0, 1.0))
    tense = muscle(in_situ(1.1), top=pull, frames=(0.0, 1.0, 2.0))
    first = AssembledBody(tense, settings)
    assert first.attempt(1.0).converged
    Restart(first, kept(CutOff(tmp_path, ()), tense)).write(1, {"size": 1.0, "cost": {}})
    again = AssembledBody(tense, settings)
    restart = Restart(again, kept(CutOff(tmp_path, (1,)), tense))
    assert restart.good() == (1,)
    restart.go_on((1,))
    assert np.array_equal(again.unknowns.x.array, first.unknowns.x.array)
    assert again.energy() == pytest.approx(first.energy(), rel=1e-12)
    assert again.system.residual() <= settings.residual
