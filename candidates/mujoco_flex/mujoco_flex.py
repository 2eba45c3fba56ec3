"""MuJoCo's flexible bodies (Todorov et al. 2012): linear tetrahedra of St. Venant-Kirchhoff, implicit steps, one thread, SI units.

It cannot take fibres, springs, a separate bulk modulus (a Poisson's ratio of at most ``poisson`` replaces it), or contact with
bones that are not convex, which it would replace by their hulls: contact is left out.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import mujoco
import numpy as np
from bridge import DAMPING, STEP, Scene, main

HEAVY = 1e3  # mass [kg] of a vertex that follows its bone


def _text(numbers: np.ndarray) -> str:
    return " ".join(f"{number:.9g}" for number in np.ravel(numbers))


class Flex:
    """A flex with one body and three slide joints for each vertex."""

    lost = ()

    def __init__(self, scene: Scene, poisson: float) -> None:
        young, _, ratio = scene.lame(poisson)
        masses = scene.masses
        masses[scene.held] = HEAVY
        slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
        places = [
            f'<body name="v{number}" pos="{_text(point)}"><inertial pos="0 0 0" mass="{mass:.9g}" diaginertia="1e-9 1e-9 1e-9"/>'
            for number, (point, mass) in enumerate(zip(scene.points, masses, strict=True))
        ]
        names = " ".join(f"v{number}" for number in range(len(masses)))
        self.model = mujoco.MjModel.from_xml_string(
            f'<mujoco><option timestep="{STEP}" gravity="0 0 0" integrator="discrete"/><worldbody>'
            f"{''.join(f'{place}{slides}</body>' for place in places)}</worldbody><deformable>"
            f'<flex name="muscle" dim="3" radius="1e-4" body="{names}" vertex="{_text(np.zeros_like(scene.points))}" '
            f'element="{_text(scene.tets)}"><elasticity young="{young:.9g}" poisson="{ratio:.9g}" damping="0.01"/>'
            '<contact selfcollide="none" contype="0" conaffinity="0"/></flex></deformable></mujoco>'
        )
        self.data, self.rest, self.held = mujoco.MjData(self.model), scene.points, scene.held

    def step(self, held: np.ndarray, bones: dict[str, np.ndarray]) -> None:
        """Move the held vertices to their positions and advance by a step."""
        moves, speeds = self.data.qpos.reshape(-1, 3), self.data.qvel.reshape(-1, 3)
        speeds *= DAMPING
        moves[self.held], speeds[self.held] = held - self.rest[self.held], 0.0
        mujoco.mj_step(self.model, self.data)
        moves[self.held] = held - self.rest[self.held]

    def positions(self) -> np.ndarray:
        """Positions of the vertices."""
        return self.rest + self.data.qpos.reshape(-1, 3)


if __name__ == "__main__":
    main(Flex, "mujoco-core", poisson=float)
