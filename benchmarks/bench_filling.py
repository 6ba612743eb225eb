"""Gap filling: the default against the paper's method, by error and by time.

    pytest benchmarks/bench_filling.py --benchmark-only -s

Gaps of 5 to 40 % of a patch, inside it and at its border, noise 0, 1e-4 and 1e-3, a smooth and a creased function.
"""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.repair.filling import METHODS, fill

SIDE = 41
U, V = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE), indexing="ij")
FUNCTIONS = {
    "smooth": 0.15 * np.sin(2 * np.pi * U) * np.cos(np.pi * V) + 0.1 * U * V,
    "creased": 0.2 * np.abs(U - 0.37 * V - 0.3) + 0.05 * np.cos(5 * V),
}


def gap(width, at_border):
    middle = width / 2 if at_border else 0.5
    return np.abs(U - middle + (0.0 if at_border else 0.1) * (V - 0.5)) >= width / 2


@pytest.mark.parametrize("method", sorted(METHODS))
@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_filling(benchmark, method, name):
    benchmark.group = f"filling a {name} function"
    exact, rng = FUNCTIONS[name], np.random.default_rng(0)
    print(f"\n{method} on {name}: largest error by gap width, noise 0 / 1e-4 / 1e-3; b = gap at the border")
    for width in (0.05, 0.1, 0.2, 0.3, 0.4):
        for at_border in (False, True):
            found, row = gap(width, at_border), []
            for noise in (0.0, 1e-4, 1e-3):
                data = np.where(found, exact + noise * rng.standard_normal(exact.shape), 0.0)
                filled, _ = fill(data, found, method=method, noise=noise)
                row.append(np.abs(filled - exact)[~found].max())
            print(f"  {width:4.2f}{'b' if at_border else ' '} " + "  ".join(f"{e:.5f}" for e in row))
    found = gap(0.2, False)
    benchmark(fill, np.where(found, exact, 0.0), found, method=method)
