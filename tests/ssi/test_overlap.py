"""Free-form surfaces that coincide in part: regions, their boundary curves and area, and what else they share."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_ssi import graph
from scipy.interpolate import BSpline
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from patchwright.models import NurbsSurface
from patchwright.ssi import intersect
from patchwright.ssi.intersection import Intersection, Overlap

WAVES = graph(lambda x, y: 0.1 * np.sin(5.0 * x) * np.cos(4.0 * y), spans=4)
PART = WAVES.restricted((0.2, 0.7), (0.3, 0.6))


def area(surface: NurbsSurface, u: tuple[float, float], v: tuple[float, float]) -> float:
    """Of a part of a graph over the unit square: z_x, z_y by Gauss quadrature on thirty points in each span."""
    x, w = np.polynomial.legendre.leggauss(30)
    at, weight = [], []
    for ts, (lo, hi) in zip(surface.breaks, (u, v), strict=True):
        ends = np.array([lo, *ts[(ts > lo) & (ts < hi)], hi])
        mid, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
        at.append((mid[:, None] + half[:, None] * x).ravel())
        weight.append((half[:, None] * w).ravel())
    slopes = [surface.grid(*at, nu)[..., 2] for nu in ((1, 0), (0, 1))]
    return float(weight[0] @ np.sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2) @ weight[1])


def checked(found: Intersection, a: NurbsSurface, b: NurbsSurface, size: float = 1.0) -> tuple[Overlap, ...]:
    """The overlaps of a proved intersection, their boundaries on both surfaces."""
    assert found.complete, {u.reason for u in found.unresolved}
    for region in found.overlaps:
        for curve in region.boundary:
            assert curve.kind == "overlap-boundary"
            assert curve.residual <= 1e-10 * size
            t = np.linspace(*curve.curve.domain, 53)
            for uv, surface in ((curve.uv_a, a), (curve.uv_b, b)):
                assert uv is not None
                w = np.clip(uv(t), *np.array(surface.domain).T)
                assert np.linalg.norm(surface(*w.T) - curve.curve(t), axis=1).max() <= 1e-13 * size
    return found.overlaps


def moved(surface: NurbsSurface, scale: float, turn: Rotation) -> NurbsSurface:
    points = scale * (surface.control_points.reshape(-1, 3) @ turn.as_matrix().T + np.array([3.0, -2.0, 1.0]))
    return NurbsSurface(surface.degree, surface.knots, points.reshape(surface.control_points.shape), surface.weights)


SAME_PATCH = {
    "as it is": PART,
    "elevated": PART.elevated(1, 2),
    "knots inserted": PART.insert_knots([0.33, 0.41], [0.5]),
    "u and v exchanged": PART.transposed(),
    "run backwards": PART.reversed("u"),
    "another range": NurbsSurface(
        PART.degree, (7.0 * PART.knots[0] - 2.0, 0.1 * PART.knots[1]), PART.control_points
    ),
    "with equal weights": NurbsSurface(
        PART.degree, PART.knots, PART.control_points, np.full(PART.control_points.shape[:2], 3.0)
    ),
}  # fmt: skip


@pytest.mark.parametrize("form", SAME_PATCH)
def test_a_sub_patch_is_found_in_every_form(form: str) -> None:
    other = SAME_PATCH[form]
    (region,) = checked(intersect(WAVES, other), WAVES, other)
    assert len(region.boundary) == 4
    assert region.area == pytest.approx(area(WAVES, (0.2, 0.7), (0.3, 0.6)), rel=1e-9)
    (region,) = checked(intersect(other, WAVES), other, WAVES)
    assert region.area == pytest.approx(area(WAVES, (0.2, 0.7), (0.3, 0.6)), rel=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_position_and_scale_do_not_matter(scale: float) -> None:
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])
    a, b = moved(WAVES, scale, turn), moved(PART, scale, turn)
    (region,) = checked(intersect(a, b), a, b, 4.0 * scale)
    assert region.area == pytest.approx(scale**2 * area(WAVES, (0.2, 0.7), (0.3, 0.6)), rel=1e-9)


def test_a_surface_and_itself() -> None:
    (region,) = checked(intersect(WAVES, WAVES), WAVES, WAVES)
    assert region.area == pytest.approx(area(WAVES, (0.0, 1.0), (0.0, 1.0)), rel=1e-9)


def test_patches_that_overlap_at_their_corners() -> None:
    a, b = WAVES.restricted((0.0, 0.6), (0.0, 0.6)), WAVES.restricted((0.4, 1.0), (0.4, 1.0))
    (region,) = checked(intersect(a, b), a, b)
    assert len(region.boundary) == 4
    assert region.area == pytest.approx(area(WAVES, (0.4, 0.6), (0.4, 0.6)), rel=1e-9)


EIGHT = graph(lambda x, y: 0.1 * np.sin(5.0 * x) * np.cos(4.0 * y), spans=8)


def lifted(rows: list[tuple[int, int | slice, float]]) -> NurbsSurface:
    points = EIGHT.control_points.copy()
    for i, j, by in rows:
        points[i, j, 2] += by
    return NurbsSurface(EIGHT.degree, EIGHT.knots, points)


def test_a_dent_leaves_a_ring() -> None:
    """Control point (5, 5) of eight cubic spans is felt on [2/8, 6/8] squared only: touching there to third order."""
    other = lifted([(5, 5, 0.1)])
    (region,) = checked(intersect(EIGHT, other), EIGHT, other)
    assert len(region.boundary) == 8
    hole = area(EIGHT, (0.25, 0.75), (0.25, 0.75))
    assert region.area + hole == pytest.approx(area(EIGHT, (0.0, 1.0), (0.0, 1.0)), rel=1e-9)


def test_two_regions() -> None:
    other = lifted([(5, slice(None), 0.1)]).restricted((0.1, 0.93), (0.22, 0.81))
    regions = checked(intersect(EIGHT, other), EIGHT, other)
    wanted = sorted(area(EIGHT, u, (0.22, 0.81)) for u in ((0.1, 0.25), (0.75, 0.93)))
    assert sorted(r.area for r in regions) == pytest.approx(wanted, rel=1e-9)


def test_an_overlap_and_a_crossing_elsewhere() -> None:
    lift = np.zeros(11)
    lift[8:] = (0.1, 0.1, -0.3)
    other = lifted([(i, slice(None), lift[i]) for i in (8, 9, 10)])
    found = intersect(EIGHT, other)
    (region,) = checked(found, EIGHT, other)
    assert region.area == pytest.approx(area(EIGHT, (0.0, 0.625), (0.0, 1.0)), rel=1e-9)
    (curve,) = found.curves
    assert curve.kind == "transversal"
    root = brentq(BSpline(EIGHT.knots[0], lift, 3), 0.9, 0.999, xtol=1e-15)
    assert curve.uv_a is not None
    assert np.abs(curve.uv_a(np.linspace(*curve.curve.domain, 41))[:, 0] - root).max() <= 1e-9
    assert curve.curve.length() == pytest.approx(EIGHT.iso_curve("v", root).length(), rel=1e-9)


def test_what_does_not_correspond_affinely_is_handed_back() -> None:
    """The same surface with u replaced by (u + u^2) / 2 coincides too; that is seen, not resolved, and never empty."""
    plain = graph(lambda x, y: 0.3 * x * y + 0.2 * x**3)
    bent = graph(lambda x, y: 0.3 * (x + x * x) / 2.0 * y + 0.2 * ((x + x * x) / 2.0) ** 3, degree=(6, 3))
    points = bent.control_points.copy()
    x = graph(lambda x, y: 0.5 * (x + x * x), degree=(6, 3)).control_points[..., 2]
    points[..., 0] = x
    found = intersect(plain, NurbsSurface(bent.degree, bent.knots, points))
    assert not found.complete
    assert any("coincide" in u.reason for u in found.unresolved)


def ring(u: tuple[float, float] = (0.0, 1.0)) -> NurbsSurface:
    """A bent tube, closed in v by C2 periodic cubics of eight spans, which is no analytic surface."""
    t, angle = np.linspace(0.0, 1.0, 5), 2.0 * np.pi * np.arange(8) / 8.0
    axis = np.stack([t, 0.4 * t * t, 0.1 * np.sin(3.0 * t)], axis=-1)
    radius = (0.2 + 0.05 * np.cos(3.0 * t))[:, None] * (1.0 + 0.1 * np.cos(2.0 * angle))
    x = axis[:, None] + np.stack([0.0 * radius, radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    values, times = ([0.0, 0.5, 1.0], np.linspace(0.0, 1.0, 9)), ([4, 1, 4], [1] * 9)
    return NurbsSurface.from_periodic((3, 3), values, times, x, periodic=(False, True)).restricted(u)


def turned(surface: NurbsSurface, start: float) -> NurbsSurface:
    """The closed surface with its seam at another v, on [start, start + 1]."""
    before, after = surface.split("v", start)
    knots = np.concatenate([after.knots[1][:-1], before.knots[1][4:] + 1.0])
    points = np.concatenate([after.control_points, before.control_points[:, 1:]], axis=1)
    return NurbsSurface(surface.degree, (surface.knots[0], knots), points)


def test_closed_surfaces_have_no_boundary_at_their_seams() -> None:
    whole, part = ring(), ring((0.2, 0.7))
    (region,) = checked(intersect(whole, part), whole, part)
    assert len(region.boundary) == 2
    assert all(c.closed for c in region.boundary)
    (all_of_it,) = checked(intersect(whole, whole), whole, whole)
    halves = [checked(intersect(whole, x), whole, x)[0].area for x in whole.split("u", 0.4)]
    assert sum(halves) == pytest.approx(all_of_it.area, rel=1e-9)


def test_a_patch_across_a_seam() -> None:
    whole = ring()
    part = turned(whole, 0.6).restricted((0.2, 0.7), (0.8, 1.3))
    found = intersect(whole, part)
    (region,) = checked(found, whole, part)
    assert region.area == pytest.approx(intersect(part, part).overlaps[0].area, rel=1e-9)
