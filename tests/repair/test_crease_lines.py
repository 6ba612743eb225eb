"""Sharp curves run straight through vertices, and the normals beside them are perpendicular to them."""

from __future__ import annotations

import numpy as np
import pytest
from quad_shapes import layout_from_quads

from patchwright.repair.patches.crease_lines import MOST_KINK, along_creases
from patchwright.repair.patches.edge_curves import fit_edges
from patchwright.repair.patches.joins import edge_end_normals
from patchwright.repair.patches.stars import leaving


def roof(crease, bend, tilt, scale=1.0, swap=False):
    """Two by two quads with a sharp edge between the rows that bends by `bend` degrees upwards in the middle.

    The rows' normals at the middle lie `crease` degrees apart and lean `tilt` degrees along the curve.
    """
    rise = np.tan(np.radians(0.5 * bend))
    x, y = np.meshgrid(np.arange(-1.0, 2.0), np.arange(-1.0, 2.0))
    z = rise * np.abs(x) - np.tan(np.radians(0.5 * crease)) * np.abs(y)
    points = scale * np.stack([x, y, z], axis=-1).reshape(-1, 3)
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
    if swap:
        quads = quads[::-1, [2, 3, 0, 1]]
    t = np.linspace(0.0, 1.0, 13)[:, None]
    layout = layout_from_quads(points, quads, lambda a, b: (1 - t) * points[a] + t * points[b], sharp=[(3, 4), (4, 5)])
    ends = points[layout.edges]
    samples = (1 - t) * ends[:, None, 0] + t * ends[:, None, 1]
    curves = fit_edges([(np.arange(len(ends)), samples)], np.full(len(ends), 2))
    half, lean = np.radians(0.5 * crease), np.radians(tilt)
    side = np.sign(points[quads].mean(axis=1)[:, 1])
    normal = np.stack(
        [0 * side + np.sin(lean), np.cos(lean) * np.sin(half) * side, 0 * side + np.cos(lean) * np.cos(half)]
    )
    return layout, curves, np.repeat(normal.T[:, None], 4, axis=1)


def off_planes(layout, curves, sectors):
    """(2,) the largest sine between the sharp curve's legs and the tangent planes on both sides of the middle."""
    unit = leaving(curves)
    unit = unit / np.linalg.norm(unit, axis=-1, keepdims=True)
    at = layout.sharp[:, None] & (layout.edges == 4)
    return np.array([np.abs((unit * n).sum(axis=-1))[at].max() for n in edge_end_normals(layout, sectors)])


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize(
    ("crease", "bend", "tilt"), [(10.0, 8.0, 0.0), (10.0, 0.0, 12.0), (60.0, 30.0, 20.0), (0.0, 5.0, 3.0)]
)
def test_curve_and_planes_agree(crease, bend, tilt, scale, swap):
    layout, curves, sectors = roof(crease, bend, tilt, scale, swap)
    lined, turned = along_creases(layout, curves, sectors)
    assert off_planes(layout, curves, sectors).max() > 0.01
    assert off_planes(layout, lined, turned).max() < 1e-12
    assert np.allclose(np.linalg.norm(turned, axis=-1), 1.0, rtol=1e-12)
    before, after = (np.linalg.norm(leaving(c), axis=-1) for c in (curves, lined))
    assert np.allclose(before, after, rtol=1e-12)
    others = ~(layout.quads == 4)
    assert np.array_equal(turned[others], sectors[others])
    assert np.array_equal(leaving(lined)[~layout.sharp], leaving(curves)[~layout.sharp])


def test_curves_in_both_planes_stay_and_so_do_corners():
    layout, curves, sectors = roof(60.0, 0.0, 0.0)
    same, normals = along_creases(layout, curves, sectors)
    assert np.array_equal(same.controls, curves.controls)
    assert np.array_equal(normals, sectors)
    layout, curves, sectors = roof(10.0, MOST_KINK + 5.0, 0.0)
    same, normals = along_creases(layout, curves, sectors)
    assert np.array_equal(same.controls, curves.controls)
    assert np.array_equal(normals, sectors)
