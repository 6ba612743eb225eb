from __future__ import annotations

import itertools

import dirty_shapes as shapes
import numpy as np
import pytest
import trimesh

from patchwright.models import Triangulation
from patchwright.ssi.flat_triangles import without_flat
from patchwright.ssi.outer_hull import outer_hull, unbalanced_edges


def with_flat(mesh: Triangulation, sides: int, parts: int, seed: int) -> Triangulation:
    """Points put on some sides of one of their two triangles only, and triangles without area to close that."""
    rng = np.random.default_rng(seed)
    points, rows = list(mesh.vertices), mesh.triangles.tolist()
    for k in rng.choice(len(rows), sides, replace=False):
        a, b, c = rows[k]
        shares = np.arange(1, parts) / parts  # exact for a power of two between corners on a lattice
        new = list(range(len(points), len(points) + parts - 1))
        points += [points[a] + t * (points[b] - points[a]) for t in shares]
        chain = [a, *new, b]
        rows[k] = [a, new[0], c]
        rows += [[p, q, c] for p, q in itertools.pairwise(chain[1:])]
        rows += [[a, q, p] for p, q in itertools.pairwise(chain[1:])]  # a fan in one line
    return Triangulation(np.array(points), np.array(rows))


@pytest.mark.parametrize("parts", [2, 4, 16])
@pytest.mark.parametrize("seed", range(4))
def test_what_has_no_area_goes_and_the_rest_stays_closed(parts: int, seed: int) -> None:
    whole = shapes.box((1, 2, 4))
    given = with_flat(whole, 9, parts, seed)
    assert unbalanced_edges(given.triangles, len(given.vertices)) == 0
    triangles, parent = without_flat(given.vertices, given.triangles)
    left = Triangulation(given.vertices, triangles)
    assert (left.areas > 0.0).all()
    assert unbalanced_edges(triangles, len(given.vertices)) == 0
    assert left.volume == pytest.approx(whole.volume, rel=1e-14)
    # every piece lies in the triangle it is told to come from
    assert np.bincount(parent, left.areas, minlength=len(given)) == pytest.approx(given.areas, abs=1e-14)


def test_a_mesh_with_area_everywhere_comes_back_as_it_is() -> None:
    ball = shapes.sphere(3)
    triangles, parent = without_flat(ball.vertices, ball.triangles)
    assert np.array_equal(triangles, ball.triangles)
    assert np.array_equal(parent, np.arange(len(ball)))


@pytest.mark.parametrize("seed", range(3))
def test_bodies_with_flat_triangles_and_copies_of_a_corner_unite(seed: int) -> None:
    """Union of two boxes: flat triangles in one, and in the other a corner that came twice, one rounding apart."""
    one = with_flat(shapes.box((1, 1, 1)), 5, 4, seed)
    two = shapes.box((1, 1, 1), at=(0.5, 0.25, 0.125))
    points = np.concatenate([two.vertices, np.nextafter(two.vertices[:1], np.inf)])
    rows = two.triangles.copy()
    around = np.flatnonzero((rows == 0).any(axis=1))
    row = rows[around[0]]
    row[row == 0] = len(points) - 1
    # the slit that opens is closed by two triangles along the copy
    others = row[row != len(points) - 1]
    slit = [[len(points) - 1, 0, v] if k else [0, len(points) - 1, v] for k, v in enumerate(others)]
    if unbalanced_edges(np.concatenate([rows, slit]), len(points)):
        slit = [triangle[::-1] for triangle in slit]
    copied = Triangulation(points, np.concatenate([rows, slit]))
    hull = outer_hull([one, copied])
    assert hull.volume == pytest.approx(2.0 - 0.5 * 0.75 * 0.875, rel=1e-13)
    assert unbalanced_edges(hull.triangles, len(hull.vertices)) == 0


def prism(rng: np.random.Generator) -> Triangulation:
    """Of height 1 on the plane z = 0."""
    mesh = trimesh.creation.cylinder(rng.uniform(0.6, 1.0), 1.0, sections=int(rng.integers(12, 40)))
    mesh.apply_translation((*rng.uniform(-0.4, 0.4, 2), 0.5))
    points = np.array(mesh.vertices)
    points[:, 2] = np.round(points[:, 2])
    return Triangulation(points, np.array(mesh.faces))


@pytest.mark.parametrize("seed", range(8))
def test_bodies_that_share_two_planes_and_are_crossed_by_others(seed: int) -> None:
    """Tops of prisms overlap in one plane where walls run through them: two sheets may meet there in several points."""
    manifold3d = pytest.importorskip("manifold3d")
    rng = np.random.default_rng(seed)
    meshes = [prism(rng) for _ in range(2)]
    wall = trimesh.creation.cylinder(rng.uniform(0.3, 0.8), 3.0, sections=24)
    wall.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
    meshes.append(shapes.of(wall))
    hull = outer_hull(meshes)
    bodies = [manifold3d.Manifold(manifold3d.Mesh64(m.vertices.copy(), m.triangles.astype(np.uint64))) for m in meshes]
    volume = manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add).volume()
    assert hull.volume == pytest.approx(volume, rel=1e-12)
    assert unbalanced_edges(hull.triangles, len(hull.vertices)) == 0
