"""The picture of a reparametrization: lines of equal parameter steps on every new face, before on the left and after on
the right."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.assembly import Assembly
from patchwright.models.surface import Surface
from patchwright.models.triangulation import Triangulation, concatenate
from patchwright.pipelines.scenes import Scene, draw_scenes
from patchwright.pipelines.view import DIRECTION
from patchwright.reparam import Region

if TYPE_CHECKING:
    from patchwright.pipelines.reparam import FaceReport

LINES = 17  # of each parameter: every other of the defect measure's steps, nearly
CHORDS = 64  # of a line
APART = 1.08  # widths of the model
BEFORE, AFTER = "#b03030", "#1f5fa8"


def draw_isolines(path: Path, assembly: Assembly, faces: Sequence[FaceReport], title: str) -> str | None:
    """Draw the picture; None, or the sentence that says why there is none."""
    body = concatenate([p.triangulation for p in assembly.parts])
    before, after = [], []
    for face in faces:
        if face.region is not None and face.result is not None:
            before.append(_lines_in(face.region))
            after.append(_lines(face.result.surface, np.array(face.result.surface.domain)))
    empty = np.zeros((0, 2, 3))
    right = np.cross([0.0, 0.0, 1.0], DIRECTION)
    right /= np.linalg.norm(right)
    low, high = body.bounds
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    shift = right * APART * float(np.ptp(corners @ right))
    box = np.stack((np.minimum(low, low + shift), np.maximum(high, high + shift)))
    scene = Scene(path, f"{title}: parameter lines before (left) and after (right)", box)
    scene.surface(body).surface(Triangulation(body.vertices + shift, body.triangles))
    scene.lines(np.concatenate([*before, empty]), colour=BEFORE, width=1.6)
    scene.lines(np.concatenate([*after, empty]) + shift, colour=AFTER, width=1.6)
    return draw_scenes([scene])


def _lines(surface: Surface, box: Array) -> Array:
    """(k, 2, 3) chords of the lines of both parameters over a box."""
    return np.concatenate([_chords(surface(*uv)) for uv in _grids(box)])


def _lines_in(region: Region) -> Array:
    """The same of a region's old parameters, what lies outside its sides left out."""
    if region.whole:
        return _lines(region.surface, region.box)
    south, north, west, east = (side.uv(np.linspace(0.0, 1.0, 129)) for side in region.sides)
    outline = np.concatenate((south, east, north[::-1], west[::-1]))
    found = []
    for u, v in _grids(region.box):
        u, v = np.broadcast_arrays(u, v)
        inside = _inside(np.stack((u, v), axis=-1).reshape(-1, 2), outline).reshape(u.shape)
        found.append(_chords(region.surface(u, v))[(inside[:, 1:] & inside[:, :-1]).ravel()])
    return np.concatenate(found)


def _grids(box: Array) -> list[tuple[Array, Array]]:
    """u and v of the lines along v, and of those along u; the first axis counts lines."""
    few, many = (np.linspace(box[:, 0], box[:, 1], count + 1).T for count in (LINES - 1, CHORDS))
    return [(few[0][:, None], many[1][None]), (many[0][None], few[1][:, None])]


def _chords(points: Array) -> Array:
    """(k, 2, 3) of points (lines, places, 3)."""
    return np.stack((points[:, :-1], points[:, 1:]), axis=2).reshape(-1, 2, 3)


def _inside(points: Array, outline: Array) -> BoolArray:
    """Whether points (k, 2) lie inside a closed polygon (n, 2), by crossings to the right."""
    a, b = outline, np.roll(outline, -1, axis=0)
    rising = (a[:, 1] > points[:, 1:]) != (b[:, 1] > points[:, 1:])  # (k, n)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = a[:, 0] + (points[:, 1:] - a[:, 1]) * ((b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1]))
    return np.asarray((rising & (points[:, :1] < at)).sum(axis=1) % 2 == 1)
