"""Edges to be halved: every face stays even, nothing is halved without need, few quads come out."""

from __future__ import annotations

import numpy as np
import pytest
from layout_shapes import cube, plate_with_hole, sphere, torus

import patchwright.repair.layout.quad_layout as quad_layout_module
from patchwright.models.errors import GeometryError
from patchwright.repair.layout.features import find_features
from patchwright.repair.layout.halving import face_costs, halved
from patchwright.repair.layout.pairing import PIECES, _split_faces, pair
from patchwright.repair.layout.remesh import remesh


def coarse_of(shape, size):
    features = find_features(shape)
    return remesh(features, np.full(len(features.body.vertices), size))


@pytest.mark.parametrize(("shape", "euler"), [(cube(4), 2), (sphere(), 2), (torus(), 0), (plate_with_hole(), 0)])
def test_few_are_fewer_pure_quads_of_the_same_topology_on_the_same_curves(shape, euler):
    coarse = coarse_of(shape, 0.35)
    few, all_halved = pair(coarse, few=True), pair(coarse)
    start, end = few.quads.reshape(-1), np.roll(few.quads, -1, axis=1).reshape(-1)
    assert len(np.unique(np.stack([start, end], axis=1), axis=0)) == few.quads.size
    edges = np.unique(np.sort(np.stack([start, end], axis=1), axis=1), axis=0)
    assert len(np.unique(few.quads)) - len(edges) + len(few.quads) == euler
    assert len(np.unique(few.quads)) == len(few.mesh.X)
    assert len(few.quads) < 0.6 * len(all_halved.quads)
    length = [
        np.linalg.norm(m.mesh.X[m.sides[:, 1]] - m.mesh.X[m.sides[:, 0]], axis=1).sum() for m in (few, all_halved)
    ]
    assert length[0] <= length[1] * (1.0 + 1e-12)
    np.testing.assert_array_equal(np.unique(few.side_curve), np.unique(all_halved.side_curve))


def test_a_cube_of_two_triangles_a_face_is_six_quads():
    assert len(pair(coarse_of(cube(1), 2.0), few=True).quads) == 6


def grid(n):
    """n x n unit squares and their edges."""
    i, j = np.divmod(np.arange(n * n), n)
    corner = i * (n + 1) + j
    faces = np.stack([corner, corner + n + 1, corner + n + 2, corner + 1], axis=1)
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, number = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    face_edges = number.reshape(-1, 4)
    edge_faces = np.full((len(edges), 2), -1)
    for f, own in enumerate(face_edges.tolist()):
        for e in own:
            edge_faces[e, int(edge_faces[e, 0] >= 0)] = f
    points = np.stack([*np.divmod(np.arange((n + 1) ** 2), n + 1), np.zeros((n + 1) ** 2)], axis=1).astype(float)
    return faces, face_edges, edge_faces, edges, points


def test_squares_stay_whole():
    faces, face_edges, edge_faces, edges, points = grid(6)
    normals = np.tile([0.0, 0.0, 1.0], (len(faces), 1))
    marks = halved(faces, face_edges, edge_faces, edges, points, normals, np.zeros(len(edges), dtype=bool))
    assert not marks.any()


def test_two_quads_back_to_back_get_no_edge_twice():
    # a tube of two squares that share two opposite sides; its rims ask for one halved side more than none
    faces = np.array([[0, 1, 2, 3], [0, 3, 2, 1]])
    edges = np.array([[0, 1], [1, 2], [2, 3], [0, 3]])
    face_edges, edge_faces = np.array([[0, 1, 2, 3], [3, 2, 1, 0]]), np.tile([0, 1], (4, 1))
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    normals = np.array([[0.0, 0, 1], [0, 0, -1]])
    marks = halved(faces, face_edges, edge_faces, edges, points, normals, np.zeros(4, dtype=bool))
    assert marks.sum() in (0, 4)


@pytest.mark.parametrize("size", [0.2, 0.5])
def test_every_face_is_even(size):
    coarse = coarse_of(torus(), size)
    triangles = coarse.triangles
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, number = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    sides = number.reshape(-1, 3)
    order = np.argsort(number, kind="stable")
    faces = np.concatenate([triangles, np.full((len(triangles), 1), -1)], axis=1)
    face_edges = np.concatenate([sides, np.full((len(triangles), 1), -1)], axis=1)
    normals = np.cross(
        coarse.vertices[triangles[:, 1]] - coarse.vertices[triangles[:, 0]],
        coarse.vertices[triangles[:, 2]] - coarse.vertices[triangles[:, 0]],
    )
    marks = halved(
        faces, face_edges, order.reshape(-1, 2) // 3, edges, coarse.vertices, normals, np.zeros(len(edges), dtype=bool)
    )
    assert (marks[sides].sum(axis=1) % 2 == 1).all()  # three sides and one or three halves
    # no two triangles of one halved side share it: the vertex in its middle would have two edges
    alone = marks[sides].sum(axis=1) == 1
    assert not (alone[order.reshape(-1, 2) // 3].all(axis=1) & marks).any()


def test_middles_of_curves_make_no_flat_quad():
    faces, normals = np.array([[0, 1, 2, -1]]), np.array([[0.0, 0.0, 1.0]])
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    cost = face_costs(faces, points, normals, np.array([[True, False, False, False]]))
    assert cost[0, 1] > 1e3 > cost[0, 2]
    assert cost[0, 0] > 1e3  # an odd face


def test_pieces_fill_their_face():
    # areas of the pieces of a unit square and of a triangle, all ways of halving, add up
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    for corners in (square, square[:3]):
        count = len(corners)
        for (sides, pattern), pieces in PIECES.items():
            if sides != count:
                continue
            middles = np.where(np.array(pattern) > 0, 4 + np.arange(count), -1)
            row = np.full((1, 4), -1)
            row[0, :count] = middles
            face = np.full((1, 4), -1)
            face[0, :count] = np.arange(count)
            quads, owner, centred = _split_faces(face, row, 8)
            spots = np.zeros((9, 2))
            spots[:count] = corners
            spots[4 : 4 + count] = 0.5 * (corners + np.roll(corners, -1, axis=0))
            spots[8] = corners.mean(axis=0)
            x, y = spots[quads][..., 0], spots[quads][..., 1]
            area = 0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
            assert (area > 0.0).all()
            np.testing.assert_allclose(area.sum(), 1.0 if count == 4 else 0.5, rtol=1e-14)
            assert len(quads) == len(pieces) == len(owner)
            assert len(centred) == int(any(8 in piece for piece in pieces))


def test_a_layout_of_too_many_quads_is_refused_at_once(monkeypatch):
    monkeypatch.setattr(quad_layout_module, "MOST_QUADS", 10)
    with pytest.raises(GeometryError, match="sharp lines with"):
        quad_layout_module.quad_layout(plate_with_hole())
