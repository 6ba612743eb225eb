from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest
import trimesh

from patchwright.models import ParameterError, Triangulation
from patchwright.ssi.cut_triangles import cut_triangles
from patchwright.ssi.mesh_mesh import mesh_intersection
from patchwright.ssi.outer_hull import outer_hull, unbalanced_edges


def box(extents=(1.0, 1.0, 1.0), at=(0.0, 0.0, 0.0)) -> Triangulation:
    """Twelve triangles."""
    mesh = trimesh.creation.box(extents=extents)
    mesh.apply_translation(at)
    return shapes.of(mesh)


@pytest.mark.parametrize("make", [box, lambda at=(0, 0, 0): shapes.box(at=at)], ids=["coarse", "fine"])
@pytest.mark.parametrize(
    ("at", "volume"),
    [
        ((0.5, 0.3, 0.2), 2 - 0.5 * 0.7 * 0.8),
        ((0.5, 0.25, 0.0), 2 - 0.5 * 0.75),  # two pairs of faces in one plane
        ((0.5, 0.0, 0.0), 1.5),  # four
        ((0.0, 0.0, 0.0), 1.0),  # all
        ((0.0, 0.0, 1.0), 2.0),  # face against face: both go
        ((0.5, 0.25, 1.0), 2.0),
        ((3.0, 0.0, 0.0), 2.0),  # apart
    ],
)
def test_two_boxes(make, at, volume) -> None:
    hull = outer_hull([make(), make(at=at)])
    assert hull.volume == pytest.approx(volume, rel=1e-14)
    assert shapes.is_closed_manifold(hull)


def test_bodies_touching_in_an_edge_or_a_corner_stay_closed() -> None:
    for at in ((1, 1, 0), (1, 1, 0.5), (1, 1, 1)):
        hull = outer_hull([box(), box(at=at)])
        assert hull.volume == pytest.approx(2.0, rel=1e-14)
        assert unbalanced_edges(hull.triangles, len(hull.vertices)) == 0


def test_a_ball_through_a_plate_adds_two_caps() -> None:
    """Volume of the faceted sphere beyond the planes z = +-1/2, summed by slices of the divergence theorem."""
    error = []
    for level in (3, 4, 5):
        hull = outer_hull([box((4, 4, 1)), shapes.sphere(level)])
        assert shapes.is_closed_manifold(hull)
        caps = 2 * np.pi * 0.5**2 * (3 - 0.5) / 3
        error.append(abs(hull.volume - 16 - caps))
    assert np.log2(error[0] / error[-1]) / 2 > 1.7


def test_nested_bodies_go_and_cavities_stay() -> None:
    outer, inner = box((4, 4, 4)), shapes.sphere(3)
    assert outer_hull([outer, inner]).volume == pytest.approx(64.0, rel=1e-14)
    cavity = Triangulation(inner.vertices, inner.triangles[:, ::-1])
    hollow = outer_hull([cavity, outer])
    assert hollow.volume == pytest.approx(64.0 - inner.volume, rel=1e-13)
    assert len(hollow) == len(outer) + len(inner)


def test_a_body_running_through_itself_is_united_with_itself() -> None:
    both = shapes.together(shapes.sphere(3), shapes.sphere(3, at=(0.9, 0.1, 0.05)))
    one = outer_hull([both])
    two = outer_hull([shapes.sphere(3), shapes.sphere(3, at=(0.9, 0.1, 0.05))])
    assert one.volume == pytest.approx(two.volume, rel=1e-14)
    assert shapes.is_closed_manifold(one)


def test_pieces_keep_their_tags_and_whole_triangles_their_vertices() -> None:
    a, b = shapes.sphere(3), shapes.box(at=(0.8, 0.1, 0.05))
    parts = [
        Triangulation(m.vertices, m.triangles, tags=np.zeros(len(m), dtype=np.int64), tag_names=(name,))
        for m, name in ((a, "ball"), (b, "block"))
    ]
    hull = outer_hull(parts)
    assert hull.tag_names == ("ball", "block")
    middle = hull.corners.mean(axis=1)
    ball = hull.tags == 0
    from patchwright.models.tree import Tree

    assert Tree.of(a).closest(middle[ball]).distance.max() < 1e-14
    assert Tree.of(b).closest(middle[~ball]).distance.max() < 1e-14
    known = {tuple(sorted(map(tuple, t))) for t in np.concatenate([a.corners, b.corners]).tolist()}
    kept = sum(tuple(sorted(map(tuple, t))) in known for t in hull.corners.tolist())
    assert kept > 0.6 * len(hull)


def union_volume(meshes: list[Triangulation]) -> float:
    """By manifold3d."""
    manifold3d = pytest.importorskip("manifold3d")
    bodies = [manifold3d.Manifold(manifold3d.Mesh64(m.vertices.copy(), m.triangles.astype(np.uint64))) for m in meshes]
    return float(manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add).volume())


@pytest.mark.parametrize("seed", range(12))
def test_random_bodies_have_the_volume_manifold3d_finds(seed: int) -> None:
    """Up to five boxes, balls, cylinders and tori; every third case on a lattice, where much coincides."""
    rng = np.random.default_rng(seed)
    meshes = []
    for _ in range(int(rng.integers(2, 6))):
        kind = rng.integers(4)
        if kind == 0:
            mesh = trimesh.creation.box(extents=np.round(rng.uniform(0.5, 2, 3) * 4) / 4)
        elif kind == 1:
            mesh = trimesh.creation.icosphere(subdivisions=2, radius=rng.uniform(0.3, 1))
        elif kind == 2:
            mesh = trimesh.creation.cylinder(
                rng.uniform(0.2, 1), rng.uniform(0.3, 2), sections=int(rng.integers(3, 30))
            )
        else:
            mesh = trimesh.creation.torus(rng.uniform(0.6, 1.2), rng.uniform(0.1, 0.5), 17, 9)
        shift = rng.uniform(-0.8, 0.8, 3)
        if seed % 3:
            mesh.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
        mesh.apply_translation(shift if seed % 3 else np.round(shift * 4) / 4)
        meshes.append(shapes.of(mesh))
    hull = outer_hull(meshes)
    assert hull.volume == pytest.approx(union_volume(meshes), rel=1e-12)
    assert unbalanced_edges(hull.triangles, len(hull.vertices)) == 0


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_and_order_do_not_matter(scale: float) -> None:
    parts = [shapes.sphere(3), shapes.sphere(3, at=(0.6, 0.1, 0.05)), shapes.box(at=(0.3, 0.7, 0.02))]
    reference = outer_hull(parts)
    scaled = [Triangulation(scale * p.vertices + scale, p.triangles) for p in parts[::-1]]
    hull = outer_hull(scaled)
    assert hull.volume == pytest.approx(scale**3 * reference.volume, rel=1e-11)
    assert len(hull) == len(reference)


def test_cutting_keeps_every_triangles_area() -> None:
    mesh = shapes.together(
        shapes.sphere(3), shapes.sphere(3, at=(0.6, 0.1, 0.05)), shapes.sphere(3, at=(0.3, 0.7, 0.02))
    )
    cut = cut_triangles(mesh, mesh_intersection(mesh))
    pieces = Triangulation(cut.vertices, cut.triangles).areas
    assert np.bincount(cut.parents, pieces) == pytest.approx(mesh.areas, rel=1e-12)
    assert unbalanced_edges(cut.triangles, len(cut.vertices)) == 0


def test_an_open_body_is_refused() -> None:
    with pytest.raises(ParameterError, match="not closed"):
        outer_hull([shapes.half(1, 0.0), box()])
    assert len(outer_hull([])) == 0
