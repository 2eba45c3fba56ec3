"""Newton's XPBD: linear tetrahedra of ``mu/2 (I1 - 3)^2 + lambda/2 (J - 1)^2``, which has no resistance to shear at rest, penalty
contact with meshes, one thread, SI units.

It cannot take fibres, springs or a separate bulk modulus. With 16 sub-steps of 5 iterations it diverges, with finite numbers.
"""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[1] / "newton_vbd")]
import newton
import numpy as np
from bridge import Scene, main
from newton_vbd import Descent


class Constraints(Descent):
    """The same model with constraints, in ``substeps`` of each step."""

    kind = newton.solvers.SolverXPBD

    def __init__(self, scene: Scene, substeps: int, iterations: int, poisson: float) -> None:
        self.substeps = substeps
        super().__init__(scene, iterations, poisson)

    def step(self, held: np.ndarray, bones: dict[str, np.ndarray]) -> None:
        """Move bones at once and held vertices in sub-steps."""
        begin = self.positions()[self.held]
        for number in range(1, self.substeps + 1):
            super().step(begin + number / self.substeps * (held - begin), bones)


if __name__ == "__main__":
    main(Constraints, "newton", substeps=int, iterations=int, poisson=float)
