"""pbatoolkit's XPBD (Macklin and Mueller 2021, doi 10.1145/3487983.3488289): linear tetrahedra of a neo-Hookean law in two
constraints each, one iteration in each of ``substeps``, one thread, SI units.

It cannot take what ``pbat_vbd`` cannot: fibres, springs, a separate bulk modulus, contact with bones.
"""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[1] / "pbat_vbd")]
import numpy as np
from bridge import Scene, main
from pbat_vbd import Descent, meshed, pbat
from pbatoolkit import pypbat


class Constraints(Descent):
    """The integrator of constraints, coloured by the library."""

    def __init__(self, scene: Scene, substeps: int, poisson: float) -> None:
        self.substeps = substeps
        super().__init__(scene, 1, poisson)

    def made(self, scene: Scene, mu: np.ndarray, lame: np.ndarray):
        """The integrator for ``mu`` and ``lame`` (e,) [Pa]."""
        mesh = np.asfortranarray(scene.points.T), np.asfortranarray(scene.tets.T.astype(np.int64))
        starts, members, _ = pypbat.sim.xpbd.partition_mesh_constraints(*mesh)
        data = meshed(pbat.sim.xpbd.Data(), scene).with_mass_inverse(1 / scene.masses)
        data = data.with_elastic_material(np.vstack((mu, lame)))
        data = data.with_damping(np.zeros(2 * len(mu)), pbat.sim.xpbd.Constraint.StableNeoHookean)
        return pbat.sim.xpbd.Integrator(data.with_partitions(starts, members).construct())


if __name__ == "__main__":
    main(Constraints, "pbatoolkit", substeps=int, poisson=float)
