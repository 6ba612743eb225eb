"""No quad of a layout is folded, on noisy and on real shapes full of slivers and short feature lines."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import Tolerance
from patchwright.models.io import read
from patchwright.models.samples import demo_aircraft
from patchwright.repair.layout.quad_layout import quad_layout
from patchwright.repair.mender.mend import mend


def mended(triangulation):
    return mend(triangulation, Tolerance.of(triangulation)).triangulation


def check(layout):
    assert layout.report.folded == 0
    assert layout.report.min_scaled_jacobian > 0.02
    assert layout.report.feature_coverage > 0.999
    assert layout.report.euler[0] == layout.report.euler[1]
    inner = np.ones(len(layout.vertices), dtype=bool)
    inner[layout.edges[layout.boundary | layout.sharp].reshape(-1)] = False
    assert np.bincount(layout.edges.reshape(-1))[inner].min() >= 3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_demo_aircraft(seed):
    check(quad_layout(mended(demo_aircraft(seed).assembly.triangulation)))


@pytest.mark.parametrize(
    "name",
    [pytest.param("dtc_hull.stl.gz", marks=pytest.mark.slow), "dtc_rudder.stl.gz", "c172_wing.stl", "boeing.off"],
)
def test_real_shapes(data, name):
    check(quad_layout(mended(read(data(name)).triangulation)))
