import numpy as np
import pytest

from patchwright.models import NurbsCurve, NurbsSurface, ParameterError, Plane, Sphere, Torus
from patchwright.models.analytic.arc import circle
from patchwright.models.closest_point import Status, closest_on_curve, closest_on_surface
from patchwright.models.knots import uniform_knots

RNG = np.random.default_rng(17)
POINTS = RNG.normal(size=(500, 3)) * 3
TORUS = Torus((0, 0, 0), (0, 0, 1), 3.0, 1.0)


def wavy(rational: bool = True, scale: float = 1.0, turn: np.ndarray | None = None, shift: float = 0.0) -> NurbsSurface:
    rng = np.random.default_rng(4)
    U, x = uniform_knots(3, 12), np.linspace(0, 1, 12)
    net = np.stack((*np.meshgrid(x, x, indexing="ij"), 0.05 * rng.normal(size=(12, 12))), axis=-1)
    weights = rng.uniform(0.5, 2, (12, 12)) if rational else None
    return NurbsSurface((3, 3), (U, U), scale * net @ (np.eye(3) if turn is None else turn.T) + shift, weights)


def test_exact_distances_to_sphere_torus_square_and_circle():
    s = Sphere((0, 0, 0), 2.0).to_nurbs().closest(POINTS)
    np.testing.assert_allclose(s.distance, np.abs(np.linalg.norm(POINTS, axis=1) - 2), atol=1e-13)
    t = TORUS.to_nurbs().closest(POINTS)
    ring = np.hypot(POINTS[:, 0], POINTS[:, 1]) - 3
    np.testing.assert_allclose(t.distance, np.abs(np.hypot(ring, POINTS[:, 2]) - 1), atol=1e-13)
    p = Plane((0, 0, 0), (0, 0, 1), None, (-1, 1), (-1, 1)).to_nurbs().closest(POINTS)
    np.testing.assert_allclose(p.points, np.clip(POINTS, [-1, -1, 0], [1, 1, 0]), atol=1e-13)
    c = circle((0, 0, 0), (0, 0, 1), 2.0).closest(POINTS)
    np.testing.assert_allclose(c.distance, np.hypot(np.hypot(POINTS[:, 0], POINTS[:, 1]) - 2, POINTS[:, 2]), atol=1e-13)
    assert (s.status == Status.CONVERGED).all()
    assert (t.status == Status.CONVERGED).all()
    assert (c.status == Status.CONVERGED).all()
    inside = (np.abs(POINTS[:, :2]) < 1).all(axis=1)
    assert (p.status == np.where(inside, Status.CONVERGED, Status.ON_BOUNDARY)).all()


@pytest.mark.parametrize("rational", [False, True])
def test_points_of_the_surface_are_found_again(rational):
    s = wavy(rational)
    uv = RNG.random((2, 500))
    c = s.closest(s(*uv))
    assert c.distance.max() < 1e-13
    np.testing.assert_allclose(np.stack((c.u, c.v)), uv, atol=1e-11)
    assert (c.status == Status.CONVERGED).all()
    np.testing.assert_allclose(c.points, s(c.u, c.v), atol=1e-15)


def test_never_worse_than_a_dense_sampling():
    s = wavy()
    points = RNG.random((300, 3)) * [1.2, 1.2, 0.4] - [0.1, 0.1, 0.2]
    found = s.closest(points)
    cells = s.grid(np.linspace(0, 1, 300), np.linspace(0, 1, 300)).reshape(-1, 3)
    dense = np.array([np.linalg.norm(cells - p, axis=1).min() for p in points])
    assert (found.status != Status.NOT_CONVERGED).all()
    assert (found.distance > dense + 1e-9).mean() <= 0.01
    inside = found.status == Status.CONVERGED
    off = points - found.points
    for nu in ((1, 0), (0, 1)):
        tangent = s(found.u, found.v, nu)
        square = np.abs((off * tangent).sum(axis=1)) / np.linalg.norm(tangent, axis=1)
        assert square[inside].max() < 1e-9


def test_boundary_feet_could_only_improve_outside():
    s = wavy()
    points = RNG.random((300, 3)) * [1.6, 1.6, 0.2] - [0.3, 0.3, 0.1]
    c = s.closest(points)
    on = c.status == Status.ON_BOUNDARY
    assert on.any()
    edge = (c.u == 0) | (c.u == 1) | (c.v == 0) | (c.v == 1)
    assert edge[on].all()


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_invariance_under_motion_and_scale(scale):
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    points = RNG.random((200, 3)) * [1, 1, 0.2] - [0, 0, 0.1]
    a = wavy().closest(points)
    b = wavy(True, scale, turn, 0.7 * scale).closest(scale * points @ turn.T + 0.7 * scale)
    np.testing.assert_allclose(b.distance, scale * a.distance, rtol=1e-9, atol=1e-13 * scale)
    np.testing.assert_allclose(np.stack((b.u, b.v)), np.stack((a.u, a.v)), atol=1e-6)
    assert (a.status == b.status).all()


def test_seams_are_crossed_and_poles_reached():
    torus = TORUS.to_nurbs()
    seam = TORUS(np.array([1e-9, 2 * np.pi - 1e-9, 0.0]), np.array([0.0, 1e-7, 2 * np.pi])) * 1.05
    start = np.tile([[2 * np.pi - 0.2, 0.2]], (3, 1))
    c = closest_on_surface(torus, seam, start=start)
    assert (c.status == Status.CONVERGED).all()
    np.testing.assert_allclose(
        c.distance, np.abs(np.hypot(np.hypot(seam[:, 0], seam[:, 1]) - 3, seam[:, 2]) - 1), atol=1e-13
    )
    poles = np.array([[0, 0, 3.0], [0, 0, 1.0], [0, 0, 2.0], [1e-9, 0, 2.5], [0, 1e-5, -3.0]])
    c = Sphere((0, 0, 0), 2.0).to_nurbs().closest(poles)
    np.testing.assert_allclose(c.distance, np.abs(np.linalg.norm(poles, axis=1) - 2), atol=1e-14)
    assert (c.status == Status.CONVERGED).all()


def test_the_centre_of_a_sphere_gets_an_answer():
    c = Sphere((0, 0, 0), 2.0).to_nurbs().closest([[0.0, 0.0, 0.0]])
    assert c.distance[0] == pytest.approx(2.0, abs=1e-14)


@pytest.mark.parametrize("dimension", [2, 3])
def test_curves_in_two_and_three_dimensions(dimension):
    rng = np.random.default_rng(8)
    c = NurbsCurve(3, uniform_knots(3, 12), rng.normal(size=(12, dimension)), rng.uniform(0.5, 2, 12))
    points = rng.normal(size=(400, dimension))
    found = c.closest(points)
    dense = c(np.linspace(0, 1, 5001))
    want = np.array([np.linalg.norm(dense - p, axis=1).min() for p in points])
    assert (found.status != Status.NOT_CONVERGED).all()
    assert (found.distance > want + 1e-12).mean() <= 0.01
    t = rng.random(200)
    again = c.closest(c(t))
    assert again.distance.max() < 1e-13


def test_a_start_leads_to_its_own_minimum():
    """The far side of a circle is the other stationary point, but no minimum: from beside it the near side is found."""
    k = circle((0, 0, 0), (0, 0, 1), 1.0)
    c = closest_on_curve(k, [[0.5, 0.0, 0.0]], start=[np.pi - 0.1])
    assert c.distance[0] == pytest.approx(0.5, abs=1e-14)
    waves = NurbsCurve(2, [0, 0, 0, 1, 2, 3, 3, 3], [[0, 0], [1, 2], [2, -2], [3, 2], [4, 0]])
    near = closest_on_curve(waves, [[3.0, 2.0]], start=[0.4])
    best = closest_on_curve(waves, [[3.0, 2.0]])
    assert best.distance[0] < near.distance[0]


def test_degenerate_shapes_do_not_fail():
    spot = NurbsCurve(1, [0, 0, 1, 1], np.ones((2, 3)))
    assert spot.closest([[1.0, 1.0, 3.0]]).distance[0] == pytest.approx(2)
    flat = NurbsSurface((1, 1), ([0, 0, 1, 1],) * 2, np.ones((2, 2, 3)))
    assert flat.closest([[1.0, 1.0, 3.0]]).distance[0] == pytest.approx(2)
    assert wavy().closest(np.zeros((0, 3))).distance.shape == (0,)


def test_every_status_has_a_sentence():
    assert len({s.sentence for s in Status}) == 3


def test_failures():
    s = wavy()
    for bad in ([[np.nan, 0, 0]], [[0.0, 0.0]], [0.0, 0.0, 0.0]):
        with pytest.raises(ParameterError):
            s.closest(bad)
    with pytest.raises(ParameterError, match="starts"):
        closest_on_surface(s, [[0, 0, 0]], start=[[2.0, 0.0]])
    with pytest.raises(ParameterError, match="samples"):
        closest_on_surface(s, [[0, 0, 0]], samples=0)
