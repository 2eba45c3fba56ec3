"""A rigid body that slides, for tests of contact."""

import sys
from dataclasses import dataclass

import cloudpickle
import numpy as np
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.rigid_bodies import Vector


@dataclass(frozen=True)
class Slide:
    """A rigid body, turned by the rotation vector ``turned`` [rad] and moved by ``start`` [mm], that goes by ``path`` [mm] from
    frame 0 to frame 1.
    """

    path: Vector
    start: Vector = (0.0, 0.0, 0.0)
    turned: Vector = (0.0, 0.0, 0.0)

    def __call__(self, frame: float) -> Floats:
        """Its pose, 4 x 4."""
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec(self.turned).as_matrix()
        pose[:3, 3] = np.array(self.start) + np.array(self.path) * frame
        return pose


cloudpickle.register_pickle_by_value(sys.modules[__name__])  # to the process that solves, which cannot import it
