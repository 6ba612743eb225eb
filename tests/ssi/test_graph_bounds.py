"""The rigorous bounds that subdivision rests on hold, and narrow with the boxes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def test_bounds_of_derivatives_hold_and_narrow() -> None:
    script = Path(__file__).parents[1] / "oracles_graph_bounds.py"
    done = subprocess.run(
        [sys.executable, str(script)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
