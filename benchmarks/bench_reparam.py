"""Placing inner points at 40 x 40: all at once by sparse Gauss-Newton, against the paper's queue (compiled).

    python benchmarks/bench_reparam.py

Both minimise the same penalty from the same start; CPU seconds of one run, one after the other, and how far the results
are apart.
"""

from __future__ import annotations

import time

import numpy as np

from patchwright.models import NurbsSurface
from patchwright.models.knots import bezier_knots
from patchwright.reparam.placement import place
from patchwright.reparam.placement_queue import place_by_queue
from patchwright.reparam.region import Region
from patchwright.reparam.start_grid import start_grid

SIZES = (10, 20, 40)


def crowded() -> NurbsSurface:
    """One bicubic span with badly placed control points."""
    x, y = np.array([0.0, 0.05, 0.15, 1.0]), np.array([0.0, 0.7, 0.9, 1.0])
    net = np.zeros((4, 4, 3))
    net[..., 0], net[..., 1] = x[:, None], y[None]
    net[1:3, 1:3, 2] = 0.4
    net[1, 2, 0] += 0.3
    net[2, 1, 1] -= 0.3
    net[0, 1, 1] -= 0.4
    return NurbsSurface((3, 3), (bezier_knots(3), bezier_knots(3)), net)


def main() -> None:
    surface = crowded()
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
