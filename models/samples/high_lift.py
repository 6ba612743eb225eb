"""A half model in high-lift configuration: fuselage, wing, slotted flap, symmetry plane and far field, clean and dirty.

The far field and the symmetry plane bound the flow, not the aircraft; the flap's slot runs into the fuselage and is no
gap; slits in the upper skin are.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly, Part
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.cutting import slit
from patchwright.models.samples.defects import damage
from patchwright.models.samples.demo import DirtySample
from patchwright.models.samples.flap import slotted_flap
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.simple import CIRCLE, HALVES, WEIGHTS
from patchwright.models.samples.soup import duplicated, flipped, missing_triangles
from patchwright.models.samples.splines import cubic
from patchwright.models.triangulation import Triangulation

ROOT = 0.05
"""Where wing and flap begin, in wing chords from the symmetry plane: inside the fuselage."""
RADIUS, NOSE, TAIL = 0.25, -1.2, 2.4
"""The fuselage's radius and ends, in wing chords, the wing's leading edge at x = 0."""
FAR = 25.0
"""Radius of the far field, in wing chords."""
SLITS = ("main",)
FACING_UP = (0.0, 0.0, 1.0)


def high_lift(*, slot: float = 0.015, span: float = 1.5, cells: tuple[int, int] = (40, 36)) -> Sample:
    """Half a fuselage (y >= 0, open at the symmetry plane), a wing and a flap that pass into it, all in wing chords.

    Parameters
    ----------
    slot : smallest distance between wing and flap, in chords
    span : of wing and flap, from inside the fuselage to their flat outer ends
    cells : of wing and flap along chord and span
    """
    lifting = slotted_flap(slot=slot, span=span, cells=cells)
    bodies = [half_fuselage(), *(b.moved(lambda points: points + np.array([0.0, ROOT, 0.0])) for b in lifting.bodies)]
    return Sample.of("high lift", tuple(bodies))


def half_fuselage(cells: tuple[int, int] = (24, 60)) -> Body:
    """Half a body of revolution about the x axis; its border lies in y = 0 to the last bit."""
    t = np.linspace(0.0, np.pi, 25)
    x = 0.5 * (NOSE + TAIL) - 0.5 * (TAIL - NOSE) * np.cos(t)
    radius = RADIUS * np.sin(t) ** 0.6
    radius[0] = radius[-1] = 0.0
    away = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(radius)))])
    V, values = cubic(away / away[-1], np.stack([x, radius], axis=1))
    circle = CIRCLE[:5]
    net = np.empty((5, len(values), 3))
    net[..., 0] = values[:, 0]
    net[..., 1] = circle[:, 1:] * values[:, 1]
    net[..., 2] = -circle[:, :1] * values[:, 1]
    surface = NurbsSurface((2, 3), (HALVES, V), net, np.repeat(WEIGHTS[:5, None], len(values), axis=1))
    lines = {"round": np.linspace(0.0, 1.0, cells[0] + 1), "length": np.linspace(0.0, 1.0, cells[1] + 1)}
    return Body("fuselage", ("skin",), (surface,), lines, (("round", "length"),), closed=False)


def surroundings(fuselage: Triangulation, *, rings: int = 8) -> tuple[Part, Part]:
    """The far field, half a sphere, and the symmetry plane between it and the fuselage's border, vertex to vertex."""
    loop = fuselage.vertices[Adjacency.of(fuselage).boundary_loops()[0]]
    centre = np.array([0.5 * (NOSE + TAIL), 0.0, 0.0])
    way = (loop - centre) / [0.5 * (TAIL - NOSE), 1.0, RADIUS]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    outer = centre + FAR * way
    outer[:, 1] = 0.0
    share = (np.geomspace(1.0, 40.0, rings + 1) - 1.0) / 39.0
    plane = loop + share[:, None, None] * (outer - loop)
    plane[-1] = outer
    up = np.linspace(0.0, 0.5 * np.pi, rings + 1)[:, None, None]
    dome = centre + FAR * (np.cos(up) * way + np.sin(up) * np.array([0.0, 1.0, 0.0]))
    dome[0] = outer
    dome[-1] = centre + np.array([0.0, FAR, 0.0])
    return Part("farfield", _strips(dome, pole=True)), Part("symmetry", _strips(plane))


def _strips(rows: Array, *, pole: bool = False) -> Triangulation:
    """Triangles between closed rows (k, n, 3); the last row is one point when there is a `pole`."""
    k, n, _ = rows.shape
    index = np.arange(k * n).reshape(k, n)
    if pole:
        index[-1] = index[-1, 0]
    a, b = index[:-1], index[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    triangles = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2).reshape(-1, 3)
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return Triangulation(rows.reshape(-1, 3), triangles[whole]).compact()


def dirty_high_lift(seed: int = 0) -> DirtySample:
    """The half model with two slits across the upper skin, missing, doubled and flipped triangles.

    The slits are 0.01 to 0.03 chords wide and run from the leading to the trailing edge at places that the seed picks;
    0.3 % of the aircraft's triangles are missing, 0.5 % doubled and 0.5 % flipped. Far field and symmetry plane are
    parts "farfield" and "symmetry" of the assembly.
    """
    sample = high_lift()
    rng = np.random.default_rng(seed)
    places, widths = rng.uniform((0.45, 0.95), (0.75, 1.35)), rng.uniform(0.01, 0.03, 2)
    steps = [
        partial(slit, point=(0.0, at, 0.0), normal=(0.0, 1.0, 0.0), width=width, only=SLITS, facing=FACING_UP)
        for at, width in zip(places, widths, strict=True)
    ]
    steps += [partial(missing_triangles, share=0.003), partial(flipped, share=0.005), partial(duplicated, share=0.005)]
    damaged = damage(sample.assembly.triangulation, steps, seed=seed)
    around = surroundings(sample.assembly.parts[0].triangulation)
    assembly = Assembly((*damaged.assembly.parts, *around), unit=sample.assembly.unit, source="dirty high lift")
    return DirtySample(sample, damaged, assembly)
