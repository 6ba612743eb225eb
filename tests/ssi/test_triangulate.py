from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import Cone, Cylinder, NurbsSurface, ParameterError, Plane, Sphere, Torus
from patchwright.models.tree import Tree
from patchwright.ssi.triangulate import triangulate

X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def wavy(seed: int = 0, n: int = 8) -> NurbsSurface:
    """A bicubic with an uneven net: far more curved in one corner than in the others."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    z = rng.normal(size=(n, n)) * 0.3 * (x * y) ** 2
    knots = np.concatenate([[0] * 3, np.linspace(0, 1, n - 2), [1] * 3]).astype(float)
    return NurbsSurface((3, 3), (knots, knots), np.stack([x, y, z], axis=-1))


closed = {
    "sphere": Sphere((1, 2, 3), 2.0),
    "sphere as NURBS": Sphere((1, 2, 3), 2.0).to_nurbs(),
    "torus": Torus((0, 0, 0), Z, 2.0, 0.5),
    "torus as NURBS": Torus((0, 0, 0), Z, 2.0, 0.5).to_nurbs(),
}
open_ones = {
    "cylinder": (Cylinder((0, 0, 0), Z, 1.0, v=(0.0, 2.0)), 2),
    "cone with apex": (Cone((0, 0, 0), Z, 0.5, 0.0, v=(0.0, 1.0)), 1),
    "half sphere": (Sphere((0, 0, 0), 1.0, v=(0.0, np.pi / 2)), 1),
    "quarter torus": (Torus((0, 0, 0), Z, 2.0, 0.5, u=(0.0, np.pi / 2)), 2),
    "plane": (Plane((0, 0, 0), Z, u=(0.0, 2.0), v=(0.0, 1.0)), 1),
    "bicubic": (wavy(), 1),
}
everything = closed | {name: surface for name, (surface, _) in open_ones.items()}


def deviation(surface, mesh) -> float:
    """Largest distance of 160 x 170 points of the surface from the triangulation."""
    (u0, u1), (v0, v1) = surface.domain
    points = surface(np.linspace(u0, u1, 160)[:, None], np.linspace(v0, v1, 170)[None])
    return float(Tree.of(mesh).closest(np.asarray(points).reshape(-1, 3)).distance.max())


@pytest.mark.parametrize("name", closed)
def test_a_closed_surface_gives_a_closed_manifold(name: str) -> None:
    mesh = triangulate(closed[name], 3e-3)
    assert shapes.is_closed_manifold(mesh)
    exact = 4 / 3 * np.pi * 8 if "sphere" in name else 2 * np.pi**2 * 2 * 0.25
    assert mesh.volume == pytest.approx(exact, abs=3e-3 * mesh.areas.sum())
    assert mesh.volume < exact


@pytest.mark.parametrize("name", open_ones)
def test_an_open_surface_has_no_crack(name: str) -> None:
    surface, rims = open_ones[name]
    mesh = triangulate(surface, 2e-3)
    from patchwright.models.adjacency import Adjacency

    adjacency = Adjacency.of(mesh)
    assert adjacency.use_count.max() == 2
    assert not adjacency.inconsistent.any()
    assert len(adjacency.boundary_loops()) == rims


@pytest.mark.parametrize("name", everything)
@pytest.mark.parametrize("tolerance", [1e-2, 2e-3])
def test_the_surface_is_within_tolerance_everywhere(name: str, tolerance: float) -> None:
    surface = everything[name]
    mesh = triangulate(surface, tolerance)
    assert deviation(surface, mesh) <= tolerance
    # the corners' parameters are those of the vertices
    corners = np.asarray(surface(mesh.uv[..., 0], mesh.uv[..., 1]))
    assert np.abs(corners - mesh.corners).max() < 1e-13 * 4
    assert mesh.areas.min() > 0.0


def test_the_number_of_triangles_grows_with_one_over_the_tolerance() -> None:
    for surface, most in ((Torus((0, 0, 0), Z, 2.0, 0.5), 1e-2), (wavy(), 1e-3)):
        tolerances = most / 4.0 ** np.arange(3)  # a quarter of the tolerance is half an edge's length
        counts = np.array([len(triangulate(surface, t)) for t in tolerances])
        slope = np.polyfit(np.log(1 / tolerances), np.log(counts), 1)[0]
        assert 0.85 < slope < 1.15


def test_triangles_are_where_the_curvature_is() -> None:
    mesh = triangulate(wavy(), 1e-4)
    middle = mesh.corners.mean(axis=1)
    lively = (middle[:, 0] > 0.5) & (middle[:, 1] > 0.5)
    quiet = (middle[:, 0] < 0.5) & (middle[:, 1] < 0.5)
    assert lively.sum() > 4 * quiet.sum()


def test_a_flat_surface_is_not_refined() -> None:
    plane = Plane((0, 0, 0), Z, u=(0.0, 2.0), v=(0.0, 1.0))
    assert len(triangulate(plane, 1e-8)) == len(triangulate(plane, 1.0))


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_does_not_matter(scale: float) -> None:
    small, large = (triangulate(Sphere((0, 0, 0), r), 5e-3 * r) for r in (1.0, scale))
    assert abs(len(small) - len(large)) <= 0.01 * len(small)


def test_a_slit_wider_than_the_tolerance_stays_open() -> None:
    gap = 0.01
    almost = Cylinder((0, 0, 0), Z, 1.0, u=(0.0, 2 * np.pi - gap), v=(0.0, 1.0))
    from patchwright.models.adjacency import Adjacency

    assert len(Adjacency.of(triangulate(almost, 1e-3)).boundary_loops()) == 1
    assert len(Adjacency.of(triangulate(almost, 0.2)).boundary_loops()) == 2


def test_what_cannot_be_triangulated_is_refused() -> None:
    with pytest.raises(ParameterError, match="bounded"):
        triangulate(Plane((0, 0, 0), Z), 1e-3)
    for tolerance in (0.0, -1.0, np.nan, 1e-16):
        with pytest.raises(ParameterError, match="tolerance"):
            triangulate(Sphere((0, 0, 0), 1.0), tolerance)
