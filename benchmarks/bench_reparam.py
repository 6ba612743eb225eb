"""Placing inner points at 40 x 40: all at once by sparse Gauss-Newton, against the paper's queue (compiled).

    python benchmarks/bench_reparam.py

Both minimise the same penalty from the same start; CPU seconds of one run, one after the other, and how far the results
are apart.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from patchwright.reparam.placement import place
from patchwright.reparam.placement_queue import place_by_queue
from patchwright.reparam.region import Region
from patchwright.reparam.start_grid import start_grid

SIZES = (10, 20, 40)


def main() -> None:
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
    from reparam_shapes import crowded_bicubic

    surface = crowded_bicubic()
    sides = Region.of_surface(surface).sides
    titles = ("grid", "queue s", "moves", "newton s", "steps", "ratio", "E queue", "E newton", "apart")
    print("".join(f"{title:>10}" for title in titles))
    for size in SIZES:
        x = np.linspace(0.0, 1.0, size + 1)
        start = start_grid(*(side.uv(x) for side in sides))
        place(surface, start, x, x)
        place_by_queue(surface, start, x, x, most=1)
        begin = time.process_time()
        fast = place(surface, start, x, x)
        middle = time.process_time()
        queue = place_by_queue(surface, start, x, x)
        end = time.process_time()
        a, b = end - middle, middle - begin
        apart = np.abs(queue.uv - fast.uv).max()
        numbers = (f"{a:.3f}", str(queue.steps), f"{b:.3f}", str(fast.steps), f"{a / b:.1f}")
        numbers += (f"{queue.penalty:.1e}", f"{fast.penalty:.1e}", f"{apart:.1e}")
        print("".join(f"{text:>10}" for text in (f"{size}x{size}", *numbers)))


if __name__ == "__main__":
    main()
