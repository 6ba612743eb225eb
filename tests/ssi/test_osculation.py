"""Points of second-order contact against cubics whose double points are known."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_ssi import flat, graph

from patchwright.models import NurbsSurface
from patchwright.models.arrays import Array
from patchwright.ssi.osculation import osculation

AT = np.array([0.37, 0.45])
TOL = 1e-10


def net(surface: NurbsSurface) -> Array:
    """The homogeneous net of a surface of one Bezier piece."""
    points = surface.control_points
    return np.ascontiguousarray(np.concatenate((points, np.ones((*points.shape[:2], 1))), axis=2))


CUBICS = {
    "monkey saddle": lambda x, y: x**3 - 3.0 * x * y**2,
    "tangent line crossed by a parabola": lambda x, y: y**2 * (x + 2.0 * y),
    "one branch": lambda x, y: x * (x**2 + y**2),
}


@pytest.mark.parametrize("name", CUBICS)
@pytest.mark.parametrize("off", [0.0, 1e-5, 1e-3])
def test_the_point_is_found_to_round_off(name: str, off: float) -> None:
    a = graph(lambda x, y: CUBICS[name](x - AT[0], y - AT[1]))
    guess = np.array([*(AT + off), *(AT - off)])
    found = osculation(net(a), net(flat()), guess, TOL)
    assert found is not None
    assert np.abs(found.point - [*AT, 0.0]).max() <= 1e-12
    assert np.abs(found.w - [*AT, *AT]).max() <= 1e-12
    assert found.gap <= 1e-15


@pytest.mark.parametrize(
    "f",
    [
        lambda x, y: x**3 - 3.0 * x * y**2 + 1e-6 * x,  # crosses there in one branch
        lambda x, y: x**3 - 3.0 * x * y**2 + 1e-2 * (x**2 + y**2),  # no such point: two equations too many
        lambda x, y: x**3 - 3.0 * x * y**2 + 1e-8,  # missed by more than the tolerance
        lambda x, y: x**3,  # along a line
        lambda x, y: x**2 - y**2,  # first order only
    ],
)
def test_nothing_else_is_taken_for_one(f) -> None:
    a = graph(lambda x, y: f(x - AT[0], y - AT[1]))
    assert osculation(net(a), net(flat()), np.array([*AT, *AT]), TOL) is None
