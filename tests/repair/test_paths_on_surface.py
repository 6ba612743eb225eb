import numpy as np
import pytest
from quad_shapes import layout_from_quads

from patchwright.models.tolerance import Tolerance
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.patches.edge_fit import edge_errors, first_curves
from patchwright.repair.patches.joins import seam_angles, side_normals, smooth_edges
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.patch_nets import folds
from patchwright.repair.patches.paths_on_surface import on_surface
from patchwright.repair.patches.resurface import resurface

RADIUS, DEPTH = 0.02, 0.4


def rim(steps, scale=1.0, turn=None, depth=DEPTH):
    """The rim of a thin plate, seen from outside: lower skin, half a circle (a knife for one step), upper skin."""
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, steps + 1)
    arc = RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if steps == 1:
        arc = np.array([[depth, 0.0]])  # both skins meet in a sharp line
    section = np.concatenate([[[-depth, -RADIUS]], arc, [[-depth, RADIUS]]])
    z = np.linspace(0.0, 1.0, 8)
    points = np.concatenate([np.repeat(section, len(z), axis=0), np.tile(z, len(section))[:, None]], axis=1)
    a, b = np.meshgrid(np.arange(len(section) - 1), np.arange(len(z) - 1), indexing="ij")
    a = (a * len(z) + b).reshape(-1)
    one, two = np.stack([a, a + len(z), a + 1], axis=1), np.stack([a + len(z), a + len(z) + 1, a + 1], axis=1)
    triangles = np.concatenate([one, two])
    points = scale * points @ (np.eye(3) if turn is None else turn)
    body = Triangulation(points, triangles)
    assert body.normals[0] @ (np.array([0.0, -1.0, 0.0]) @ (np.eye(3) if turn is None else turn)) > 0.9
    return body


def over(body, middle=(0.47, 0.52), path=None):
    """Two quads side by side that wrap the rim; the path between them is the straight line through the body."""
    ends = body.vertices[[0, 7, -8, -1]].reshape(2, 2, 3)  # lower and upper, each from z = 0 to z = 1
    ends = [[*(e[0] + s * (e[1] - e[0]) for s in (0.0, m, 1.0))] for e, m in zip(ends, middle, strict=True)]
    vertices = np.array([*ends[0], *ends[1]])
    quads = np.array([[0, 3, 4, 1], [1, 4, 5, 2]])
    return layout_from_quads(vertices, quads, path or (lambda a, b: around(body, vertices, a, b)))


def around(body, vertices, a, b):
    """Boundary paths as they run; straight through the body between both middles."""
    on = {0: slice(0, None, 8), 2: slice(7, None, 8)}
    return body.vertices[on[a]] if b == a + 3 and a in on else vertices[[a, b]]


def target(body):
    return Target(Tree.of(body), np.zeros(len(body), dtype=bool))


def inner(layout):
    return int(np.flatnonzero(smooth_edges(layout))[0])


def length(path):
    return np.linalg.norm(np.diff(path, axis=0), axis=1).sum()


def test_a_path_through_the_body_is_led_round_the_rim():
    body = rim(24)
    given = over(body, (0.5, 0.5))
    layout = on_surface(given, target(body), np.full(len(given.edges), 1e-3))
    path = layout.path(inner(layout))
    steps = np.concatenate([(1 - s) * path[:-1] + s * path[1:] for s in (0.0, 0.3, 0.7)])
    assert Tree.of(body).closest(steps).distance.max() < 1e-12
    assert length(path) == pytest.approx(2 * DEPTH + 48 * RADIUS * np.sin(np.pi / 48), rel=1e-5)
    assert (path[[0, -1]] == given.path(inner(given))).all()


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_way_moves_with_the_model(scale):
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    paths = []
    for body, size in ((rim(24), 1.0), (rim(24, scale, turn), scale)):
        given = over(body)
        layout = on_surface(given, target(body), np.full(len(given.edges), 1e-3 * size))
        paths.append(layout.path(inner(layout)))
    assert paths[1] == pytest.approx(scale * paths[0] @ turn, abs=1e-9 * scale)


def test_other_paths_stay_bit_for_bit_and_so_does_a_layout_that_does_not_stray():
    body = rim(24)
    given = over(body)
    layout = on_surface(given, target(body), np.full(len(given.edges), 1e-3))
    for edge in np.flatnonzero(~smooth_edges(given)):
        assert (layout.path(edge) == given.path(edge)).all()
    assert on_surface(layout, target(body), np.full(len(given.edges), 1e-9)) is layout


def test_no_way_leads_across_a_sharp_line():
    body = rim(1)
    given = over(body)
    layout = on_surface(given, target(body), np.full(len(given.edges), 1e-3))
    assert (layout.path_points == given.path_points).all()


def test_first_curves_follow_the_rim_with_the_fewest_pieces_that_do():
    body = rim(24)
    ground = target(body)
    most = np.full(7, 0.1 * RADIUS)
    layout = on_surface(over(body), ground, most)
    curves = first_curves(layout, ground, most, 2, 64)
    assert (edge_errors(layout, curves, ground) <= most).all()
    edge = inner(layout)
    halved = first_curves(layout, ground, np.full(7, np.inf), int(curves.cells[edge]) // 2, 64)
    assert edge_errors(layout, halved, ground)[edge] > most[edge]
    assert curves.cells.min() == 2  # the straight borders need no more


def test_patches_over_a_thin_rim_neither_fold_nor_part():
    body = rim(24, depth=2.0 * RADIUS)
    network = resurface(over(body), target(body), Tolerance(gap=1e-9, fit=0.05 * RADIUS))
    assert folds(network.nets).max() == 0.0
    angle = seam_angles(network.layout, side_normals(network.layout, network.nets))
    assert angle[smooth_edges(network.layout)].max() < 0.25
    assert network.deviation.max() < 0.1 * RADIUS


def test_a_layout_without_smooth_edges_stays():
    body = rim(24)
    vertices = body.vertices[[0, 7, -8, -1]]
    one = layout_from_quads(vertices, np.array([[0, 2, 3, 1]]), lambda a, b: vertices[[a, b]])
    assert on_surface(one, target(body), np.full(4, 1e-3)) is one


def test_a_first_curve_that_no_number_of_pieces_brings_near_keeps_the_fewest():
    body = rim(24)
    ground = target(body)
    given = over(body)  # the inner path leads through the body, deeper than half the radius whatever the curve
    curves = first_curves(given, ground, np.full(7, 0.1 * RADIUS), 2, 16)
    assert curves.cells[inner(given)] == 2
    loose = first_curves(given, ground, np.full(7, 2.0 * RADIUS), 2, 16)
    assert (np.asarray(loose.cells) == 2).all()
