"""The proof that a surface does not meet itself."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from patchwright.models import NurbsSurface, Plane
from patchwright.ssi import intersect
from patchwright.ssi.embedded import is_embedded

KNOTS = np.repeat([0.0, 1.0], 4)


def graph(heights):
    x, y = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 4), indexing="ij")
    return NurbsSurface((3, 3), (KNOTS, KNOTS), np.stack([x, y, heights], axis=-1))


def test_a_gentle_graph_is_proved_and_scale_does_not_matter():
    heights = 0.1 * np.sin(np.arange(16.0)).reshape(4, 4)
    surface = graph(heights)
    for scale in (1e-6, 1.0, 1e6):
        assert is_embedded(NurbsSurface((3, 3), (KNOTS, KNOTS), scale * surface.control_points))
    assert intersect(surface).complete


def test_a_loop_is_never_proved():
    # a cubic with a loop, swept along y: it does meet itself
    loop = np.array([[0.0, 0, 0], [3, 0, 2], [-2, 0, 2], [1, 0, 0]])
    net = loop[:, None] + np.array([0.0, 1.0, 2.0, 3.0])[None, :, None] * np.array([0.0, 1.0, 0.0])
    surface = NurbsSurface((3, 3), (KNOTS, KNOTS), net)
    assert not is_embedded(surface)
    assert intersect(surface).curves


def test_planes_need_no_proof():
    assert intersect(Plane([0, 0, 0], [0, 0, 1], u=(0, 1), v=(0, 1))).complete


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-0.8, 0.8), min_size=48, max_size=48))
def test_what_is_proved_keeps_its_points_apart(moves):
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij")
    net = np.stack([x, y, np.zeros((4, 4))], axis=-1) + np.array(moves).reshape(4, 4, 3)
    surface = NurbsSurface((3, 3), (KNOTS, KNOTS), net)
    if is_embedded(surface):
        t = np.linspace(0, 1, 9)
        points = surface.grid(t, t).reshape(-1, 3)
        apart = np.linalg.norm(points[:, None] - points[None], axis=-1) + 1e3 * np.eye(81)
        assert apart.min() > 1e-6
