import numpy as np
import oracles_nurbs as oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patchwright.models import KnotError, NurbsSurface, ParameterError, Sphere, Surface
from patchwright.models.knots import bezier_knots, uniform_knots


def random_surface(seed: int, degree: tuple[int, int], rational: bool, clamped: bool = True) -> NurbsSurface:
    rng = np.random.default_rng(seed)

    def knots(p: int) -> np.ndarray:
        inner = np.sort(rng.uniform(0.1, 0.9, 3))
        inner = np.sort(np.concatenate((inner, inner[1:2].repeat(min(1, p - 1)))))
        if clamped:
            return np.concatenate((np.zeros(p + 1), inner, np.ones(p + 1)))
        return np.concatenate((np.sort(-np.arange(p + 1) * 0.1), inner, 1 + np.arange(p + 1) * 0.2))

    U, V = knots(degree[0]), knots(degree[1])
    shape = (len(U) - degree[0] - 1, len(V) - degree[1] - 1)
    weights = rng.uniform(0.4, 2.5, shape) if rational else None
    return NurbsSurface(degree, (U, V), rng.normal(size=(*shape, 3)), weights)


UV = np.random.default_rng(3).random((2, 150))


@pytest.mark.parametrize("degree", [(3, 3), (1, 2), (4, 3), (6, 1)])
@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize("clamped", [True, False])
def test_points_and_derivatives_agree_with_the_exact_recursion(degree, rational, clamped):
    s = random_surface(1, degree, rational, clamped)
    for u, v in [(0.37, 0.61), (1.0, 0.2), (0.0, 1.0)]:
        scale = np.abs(s.control_points).max()
        for nu in [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (3, 3)]:
            want = oracle.surface_derivative(degree, s.knots, s.control_points, s.weights, u, v, nu)
            scale = max(scale, np.abs(want).max())
            np.testing.assert_allclose(s(u, v, nu), want, rtol=0, atol=1e-12 * scale)
            np.testing.assert_allclose(s.grid([u], [v], nu)[0, 0], want, rtol=0, atol=1e-12 * scale)


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10**6), p=st.integers(1, 5), q=st.integers(1, 5), rational=st.booleans(), clamped=st.booleans()
)
def test_every_change_of_representation_keeps_the_shape(seed, p, q, rational, clamped):
    s = random_surface(seed, (p, q), rational, clamped)
    u, v = UV
    x = s(u, v)
    atol = 1e-13 * np.abs(s.control_points).max() * (1.0 if s.weights is None else s.weights.max() / s.weights.min())
    more = np.random.default_rng(seed).random((2, 3))
    np.testing.assert_allclose(s.insert_knots(*more)(u, v), x, rtol=0, atol=atol)
    np.testing.assert_allclose(s.clamped()(u, v), x, rtol=0, atol=atol)
    np.testing.assert_allclose(s.elevated(1, 2)(u, v), x, rtol=0, atol=10 * atol)
    np.testing.assert_allclose(s.transposed()(v, u), x, rtol=0, atol=atol)
    np.testing.assert_allclose(s.reversed("u")(1 - u, v), x, rtol=0, atol=10 * atol)
    np.testing.assert_allclose(s.reversed("v")(u, 1 - v), x, rtol=0, atol=10 * atol)
    for direction, t in (("u", u), ("v", v)):
        for part, inside in zip(s.split(direction, 0.4), (t <= 0.4, t >= 0.4), strict=True):
            np.testing.assert_allclose(part(u[inside], v[inside]), x[inside], rtol=0, atol=atol)
    patches = s.bezier_patches()
    for row in patches:
        for patch in row:
            (u0, u1), (v0, v1) = patch.domain
            inside = (u0 < u) & (u < u1) & (v0 < v) & (v < v1)
            assert patch.control_points.shape == (p + 1, q + 1, 3)
            np.testing.assert_allclose(patch(u[inside], v[inside]), x[inside], rtol=0, atol=atol)
    assert (len(patches), len(patches[0])) == (len(s.breaks[0]) - 1, len(s.breaks[1]) - 1)


@pytest.mark.parametrize("degree", [(3, 3), (1, 3), (5, 3), (2, 2)])
@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_jet_is_all_derivatives_up_to_its_order(degree, rational, order):
    s = random_surface(5, degree, rational)
    members = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)][: (1, 3, 6)[order]]
    u, v = np.array([0.0, 0.31, 1.0]), np.array([0.0, 0.2, 0.55, 1.0])
    for found in (s.jet(u[:, None], v, order), s.grid_jet(u, v, order)):
        assert found.shape == (3, 4, len(members), 3)
        for c, nu in enumerate(members):
            for i, j in np.ndindex(3, 4):
                want = oracle.surface_derivative(degree, s.knots, s.control_points, s.weights, u[i], v[j], nu)
                np.testing.assert_allclose(found[i, j, c], want, rtol=0, atol=1e-12 * max(1.0, np.abs(want).max()))
    with pytest.raises(ParameterError, match="order 0, 1 or 2, got 3"):
        s.jet(0.5, 0.5, 3)
    with pytest.raises(ParameterError, match="outside the domain"):
        s.grid_jet([0.5], [1.5], order)


def test_grid_and_scattered_agree_and_broadcast():
    s = random_surface(2, (3, 2), True)
    u, v = np.linspace(0, 1, 7), np.linspace(0, 1, 5)
    for nu in [(0, 0), (1, 0), (2, 1)]:
        a, b = s.grid(u, v, nu), s(u[:, None], v, nu)
        assert a.shape == b.shape == (7, 5, 3)
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-11)
    assert s(0.5, 0.5).shape == (3,)
    jets = s.derivatives(u, u, (2, 1))
    assert jets.shape == (7, 3, 2, 3)
    np.testing.assert_allclose(jets[:, 2, 1], s(u, u, (2, 1)), rtol=1e-12)


@pytest.mark.parametrize("rational", [False, True])
def test_corners_are_control_points_and_edges_are_their_curves(rational):
    s = random_surface(5, (3, 3), rational)
    t = np.linspace(0, 1, 30)
    assert np.abs(s(1.0, 1.0) - s.control_points[-1, -1]).max() < 1e-15
    for side, u, v, points in [
        ("u0", 0.0, t, s.control_points[0]),
        ("u1", 1.0, t, s.control_points[-1]),
        ("v0", t, 0.0, s.control_points[:, 0]),
        ("v1", t, 1.0, s.control_points[:, -1]),
    ]:
        edge = s.boundary(side)
        assert (edge.control_points == points).all()
        np.testing.assert_allclose(edge(t), s(u, v), atol=1e-14)
    open_ends = random_surface(5, (3, 3), rational, clamped=False)
    np.testing.assert_allclose(open_ends.boundary("u1")(t), open_ends(1.0, t), atol=1e-13)
    np.testing.assert_allclose(s.iso_curve("u", 0.3)(t), s(t, 0.3), atol=1e-13)
    np.testing.assert_allclose(s.iso_curve("v", 0.3)(t), s(0.3, t), atol=1e-13)


def test_invariance_under_rigid_motion_and_scale():
    s = random_surface(8, (3, 3), True)
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    for scale in (1e-3, 1e3):
        moved = NurbsSurface(s.degree, s.knots, scale * s.control_points @ turn.T + [5.0, -3.0, 2.0], s.weights)
        np.testing.assert_allclose(
            moved(*UV), scale * s(*UV) @ turn.T + [5, -3, 2], rtol=0, atol=1e-14 * max(scale, 10) * 10
        )


def test_unequal_knots_stay_accurate():
    """The bicubic table of powers against the exact recursion where spans differ by 1e8."""
    U = np.array([0, 0, 0, 0, 1e-8, 0.5, 0.5 + 1e-8, 1, 1, 1, 1.0])
    s = NurbsSurface((3, 3), (U, U), np.random.default_rng(0).normal(size=(7, 7, 3)))
    for u, v in [(3e-9, 0.2), (0.5 + 4e-9, 0.50000003), (0.1, 0.9999999)]:
        want = oracle.surface_derivative(s.degree, s.knots, s.control_points, None, u, v, (0, 0))
        np.testing.assert_allclose(s(u, v), want, rtol=0, atol=2e-14)


def test_doubly_periodic_surface_closes_smoothly():
    rng = np.random.default_rng(2)
    values, ones = np.arange(6.0), np.ones(6, dtype=int)
    s = NurbsSurface.from_periodic(
        (3, 2), (values, values), (ones, ones), rng.normal(size=(5, 5, 3)), rng.uniform(0.5, 2, (5, 5))
    )
    t = np.linspace(0, 5, 21)
    for nu in [(0, 0), (1, 0), (2, 0), (0, 1)]:
        np.testing.assert_allclose(s(0.0, t, nu), s(5.0, t, nu), atol=1e-11)
    for nu in [(0, 0), (0, 1)]:
        np.testing.assert_allclose(s(t, 0.0, nu), s(t, 5.0, nu), atol=1e-11)
    half = NurbsSurface.from_periodic(
        (3, 1), (values, [0.0, 1.0]), (ones, [2, 2]), rng.normal(size=(5, 2, 3)), periodic=(True, False)
    )
    assert half.domain == ((0.0, 5.0), (0.0, 1.0))


def test_is_a_surface():
    assert isinstance(random_surface(0, (1, 1), False), Surface)


@pytest.mark.parametrize(
    ("change", "error", "match"),
    [
        ({"knots": (bezier_knots(3), bezier_knots(2))}, KnotError, "knots in v"),
        ({"knots": (bezier_knots(3)[::-1], bezier_knots(3))}, KnotError, "decrease"),
        ({"control_points": np.full((4, 4, 3), np.nan)}, ParameterError, "not finite"),
        ({"control_points": np.zeros((4, 4, 2))}, ParameterError, r"\(n, m, 3\)"),
        ({"weights": np.zeros((4, 4))}, ParameterError, "positive"),
        ({"weights": np.ones(4)}, ParameterError, "shape"),
    ],
)
def test_bad_input_is_refused(change, error, match):
    good = {"degree": (3, 3), "knots": (bezier_knots(3), bezier_knots(3)), "control_points": np.zeros((4, 4, 3))}
    with pytest.raises(error, match=match):
        NurbsSurface(**{**good, **change})


def test_nothing_is_extrapolated():
    s = random_surface(0, (3, 3), False)
    for call in (s, s.grid):
        with pytest.raises(ParameterError, match=r"parameter v = 1\.5"):
            call([0.5], [1.5])
        with pytest.raises(ParameterError, match="order"):
            call([0.5], [0.5], (-1, 0))


def test_a_sphere_has_its_normals_even_at_the_poles():
    centre = np.array([1.0, 2.0, 3.0])
    for s in (Sphere(centre, 2.0, axis=(1, 1, 0)), Sphere(centre, 2.0, axis=(1, 1, 0)).to_nurbs()):
        u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 9), [-np.pi / 2, -1.5, 0, 1.0, np.pi / 2])
        normals = s.to_nurbs().normal(u, v)
        np.testing.assert_allclose(normals, (s.to_nurbs()(u, v) - centre) / 2, atol=1e-13)


def test_uniform_knots_have_equal_spans():
    np.testing.assert_allclose(np.diff(np.unique(uniform_knots(3, 8))), 0.2)


@pytest.mark.parametrize("width", [1e-310, 1e-5, 1.0, 1e300])
@pytest.mark.parametrize("start", [0.0, -3.0])
def test_spans_are_found_among_clustered_and_repeated_knots_on_any_scale(width, start):
    """Many parameters are looked up in a table of spans; one alone is bisected. Both give the same points."""
    if start and start + width * 1e-9 == start:
        pytest.skip("the knots would coincide")
    inner = (
        np.array([1e-9, 2e-9, 0.5, 0.5, 0.5 + 1e-12, 0.7, 0.7, 0.7, 0.999]) if start == 0.0 else np.linspace(0, 1, 9)
    )
    U = start + width * np.concatenate((np.zeros(4), inner, np.ones(4)))
    U = U[:4].tolist() + sorted(x for x in U[4:-4] if U[3] < x < U[-1]) + U[-4:].tolist()
    V = np.array([0.0, 0, 0, 1, 1, 1])
    net = np.random.default_rng(0).normal(size=(len(U) - 4, 3, 3))
    S = NurbsSurface((3, 2), (U, V), net)
    knots = np.array(S.breaks[0])
    u = np.concatenate((knots, np.nextafter(knots[1:], -np.inf), np.linspace(knots[0], knots[-1], 500)))
    u = np.clip(u, knots[0], knots[-1])
    many = S(u, 0.3)
    one = np.array([S(float(x), 0.3) for x in u])
    np.testing.assert_array_equal(many, one)
    np.testing.assert_allclose(many, S.grid(u, np.array([0.3]))[:, 0], rtol=0, atol=1e-13)
