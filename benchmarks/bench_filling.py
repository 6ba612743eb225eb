"""Gap filling: the default against the paper's method, by time; `table_filling.py` judges their errors.

    pytest benchmarks/bench_filling.py --benchmark-only

A gap of 20 % across the middle of a 41 by 41 grid.
"""

from __future__ import annotations

import numpy as np
import pytest
from table_filling import FUNCTIONS, KNOWN

from patchwright.repair.patches.filling import METHODS, fill


@pytest.mark.parametrize("method", sorted(METHODS))
@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_filling(benchmark, method, name):
    benchmark.group = f"filling a {name} function"
    exact, found = FUNCTIONS[name], KNOWN["middle"](0.2)
    benchmark(fill, np.where(found, exact, 0.0), found, method=method)
