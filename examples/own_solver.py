"""A solver of your own as a candidate: each vertex follows the lower bone by a fraction that depends on its height (skinning).

It writes a mesh for each frame, as a program in any language could, and is compared with the finite element reference.
"""

from pathlib import Path

import meshio
import numpy as np
from own_scene import make

import fem_reference as fr


def write_frames(case: fr.Case, folder: str, share_at_end: float = 1.0) -> None:
    """Write the frames of the solver; the lower bone rotates by 15 degrees over 20 frames about x through (0, 25, 0) mm."""
    rest = meshio.read("my_muscle/muscle.ply")
    share = share_at_end * (1 - rest.points[:, 2:] / rest.points[:, 2].max())
    Path(folder).mkdir(exist_ok=True)
    for frame in case.numbers:
        angle = np.deg2rad(15 * frame / 20)
        turn = [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]]
        turned = (rest.points - [0, 25, 0]) @ np.transpose(turn) + [0, 25, 0]
        points = rest.points + share * (turned - rest.points)
        meshio.Mesh(points, rest.cells).write(f"{folder}/frame_{frame:04d}.ply")


if __name__ == "__main__":
    case = make()
    write_frames(case, "skinning")
    mine = fr.read_run("skinning", case)
    result = fr.compare(case, fr.solve(case), [mine])
    for metric, statistic in (("volume", "deviation"), ("fibre_length", "rms"), ("surface_deviation", "rms")):
        measure = result[mine.name, metric, statistic]
        print(metric, statistic, measure.values.round(3), measure.unit)
    print("page:", fr.write_report(result, "my_page"))
    print("greatest deviation of my solver [mm]:", result[mine.name, "surface_deviation", "max"].values.max())
# Ends in 4.24 within 0.0848: pinned.
