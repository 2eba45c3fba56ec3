"""A material law of your own, in a file outside the package: effects/yeoh.py. A block of this material is stretched.

FEM_REFERENCE_EFFECTS lists folders of such files; scene files name these effects like any other effect.
"""

import os
from pathlib import Path

os.environ["FEM_REFERENCE_EFFECTS"] = str(Path(__file__).parent / "effects")

import fem_reference as fr

C1, C2, C3, STRETCH = 0.005, 0.001, 0.0005, 1.5  # [MPa], [MPa], [MPa], 1

law = fr.make_effect("yeoh", c1=C1, c2=C2, c3=C3)
block = fr.box((2, 2, 2), (10.0, 10.0, 10.0), "tetrahedron")
fixed = [
    fr.Prescribed(face, face, (axis,), lambda points, _: 0 * points) for axis, face in enumerate(("x0", "y0", "z0"))
]
pulled = fr.Prescribed("top", "z1", (2,), lambda points, frame: (STRETCH - 1) * frame * points * (0, 0, 1))
effects = (law, fr.make_effect("incompressible", bulk=100.0))
solved = fr.solve_body(fr.Body(block, effects, (*fixed, pulled), frames=(0.0, 0.5, 1.0)), first_step=0.25)

# Incompressible and uniaxial: the nominal stress is 2 (l - 1 / l^2) dW/dI with I = l^2 + 2 / l, on 100 mm2.
over = STRETCH**2 + 2 / STRETCH - 3
exact = 100 * 2 * (STRETCH - STRETCH**-2) * (C1 + 2 * C2 * over + 3 * C3 * over**2)
print("force [N]:", solved.last.forces["top"][2], "exact:", exact)
print("ratio:", solved.last.forces["top"][2] / exact)
# Ends in 1 within 5e-4: closed form of incompressible material; here the bulk modulus is 10^4 shear moduli.
