"""Program that draws the pictures of a job file: ``python -P pictures.py JOB.pickle FOLDER``.

It runs as a separate process, because VTK ends its process without an exception if there is no OpenGL library.

The job has ``top``, the end of the colour scale [mm]; ``triangles`` (m, 3); ``directions`` (2, 3) towards the two cameras; points
and triangles of each of the ``bones``; and ``shots``. Each shot has ``points`` (n, 3), and ``poses`` (4, 4) of the bones. It may
have ``distances`` (n,) [mm], which determine colours, and ``outline`` (n, 3), a body whose outline is drawn on top; otherwise both
are None. View k of shot i is written to ``i_k.webp``.
"""

import pickle
import sys
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from PIL import Image

COLOURS = "viridis"
SIDE = 840
_OVERSAMPLING = 2
# A pixel of a body belongs to the outline of the body if a pixel four pixels away is outside the body.
_NEAR = np.logical_and.outer(*[np.isin(np.arange(9), (0, 4, 8))] * 2)
_MUSCLE, _BONE, _LINE = "#b4574e", "#dedbd4", (25, 25, 25)


def main(job: Path, folder: Path) -> None:
    """Draw every view of every shot."""
    given = pickle.loads(job.read_bytes())
    bones = [_surface(*bone) for bone in given["bones"]]
    for i, shot in enumerate(given["shots"]):
        posed = [bone.transform(pose, inplace=False) for bone, pose in zip(bones, shot["poses"], strict=True)]
        for view, direction in enumerate(given["directions"]):
            image = _view(given, shot, posed, direction)
            image.save(folder / f"{i}_{view}.webp", quality=88, method=4)


def _surface(points: NDArray[Any], triangles: NDArray[Any]) -> Any:
    import pyvista

    return pyvista.PolyData.from_regular_faces(points, triangles).compute_normals(
        cell_normals=False, split_vertices=False, auto_orient_normals=False, consistent_normals=False
    )


def thinned(points: NDArray[Any], triangles: NDArray[Any], count: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Reduce ``points`` (n, 3) and ``triangles`` (m, 3) to about ``count`` triangles by quadric errors (Garland and Heckbert 1997,
    doi 10.1145/258734.258849). The result is good enough for pictures, not for computation.
    """
    import pyvista

    if len(triangles) <= count:
        return points, triangles
    fine = pyvista.PolyData.from_regular_faces(np.asarray(points, float), triangles)
    few = fine.decimate(1 - (count - 1) / len(triangles))
    return np.asarray(few.points, float), np.asarray(few.regular_faces)


def _view(job: dict[str, Any], shot: dict[str, Any], bones: list[Any], direction: NDArray[Any]) -> Image.Image:
    points, outline, distances = (shot[name] for name in ("points", "outline", "distances"))
    camera = _camera(points, points if outline is None else outline, direction)
    muscle = _surface(points, job["triangles"])
    coloured: dict[str, Any] = {"color": _MUSCLE}
    if distances is not None:
        coloured = {"scalars": distances, "cmap": COLOURS, "clim": (0.0, max(job["top"], 1e-12))}
    looks: dict[str, Any] = {"smooth_shading": True, "ambient": 0.35, "diffuse": 0.7, "show_scalar_bar": False}
    picture = _render([(bone, looks | {"color": _BONE}) for bone in bones] + [(muscle, looks | coloured)], camera)
    if outline is not None:
        flat = {"color": "black", "lighting": False}
        body = _render([(_surface(outline, job["triangles"]), flat)], camera)[:, :, 0] < 128
        picture[body & ~scipy.ndimage.binary_erosion(body, _NEAR)] = _LINE
    return Image.fromarray(picture).resize((SIDE, SIDE), Image.Resampling.LANCZOS)


def _camera(points: NDArray[Any], frame: NDArray[Any], direction: NDArray[Any]) -> dict[str, Any]:
    """A camera with parallel projection that looks from ``direction`` at the body ``frame`` (n, 3). The view also includes
    ``points``, up to twice the size of the body.
    """
    middle = (frame.max(axis=0) + frame.min(axis=0)) / 2
    own, both = (float(np.linalg.norm(cloud - middle, axis=1).max()) for cloud in (frame, np.vstack([frame, points])))
    up = (0.0, 0.0, 1.0) if abs(direction[2]) < 0.95 else (0.0, 1.0, 0.0)
    return {"middle": middle, "direction": direction, "half": 1.06 * min(both, 2 * own), "up": up}


def _render(bodies: list[tuple[Any, dict[str, Any]]], camera: dict[str, Any]) -> NDArray[Any]:
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=[SIDE * _OVERSAMPLING] * 2)
    # Multisampling would take four fifths of the drawing time; the oversampling already smooths edges.
    plotter.render_window.SetMultiSamples(1)
    plotter.set_background("white")
    for body, looks in bodies:
        plotter.add_mesh(body, **looks)
    plotter.camera.focal_point = camera["middle"]
    plotter.camera.position = camera["middle"] + 10 * camera["half"] * camera["direction"]
    plotter.camera.up = camera["up"]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = camera["half"]
    plotter.reset_camera_clipping_range()
    picture = np.array(plotter.screenshot(return_img=True))
    plotter.close()
    return picture


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
