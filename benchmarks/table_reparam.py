"""Reparametrisation of three made shapes and four faces of real files, at three tolerances each.

    python benchmarks/table_reparam.py [NAME ...]

Faces come from `PATCHWRIGHT_DATA` (default ../shared/data); a file that is absent is left out. Tolerances are shares
of the diagonal of the box round the surface. Columns: the deviation in parts of the tolerance, measured by closest
points on 20 x 20 samples a cell where the fit used 5 x 5; the defect (33 equal steps) before and after; control points
before and after; the least sine between the new tangents, negative where the surface folds; CPU seconds. `ok` is NO
where the tolerance is not kept, the surface folds, or a defect above 0.5 did not fall tenfold.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from patchwright.models.io import read
from patchwright.reparam import Region, face_region, reparametrize

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("PATCHWRIGHT_DATA", HERE.parent.parent / "shared" / "data"))
FACES = (
    ("fuselage_patches.stp", 3),
    ("turbine_part.stp", 41),
    ("nacelle.stp", 2),
    ("oneram6.igs", 7),
)  # numbered from 1
SHARES = (1e-3, 1e-4, 1e-5)


def regions(names: list[str]) -> Iterator[tuple[str, Region]]:
    """The shapes and faces, by name."""
    sys.path.insert(0, str(HERE.parent / "tests"))
    from reparam_shapes import clustered_wing, crowded_bicubic, octant

    for name, make in (("bicubic", crowded_bicubic), ("wing", clustered_wing), ("octant", octant)):
        if not names or name in names:
            yield name, Region.of_surface(make())
    for file, number in FACES:
        name = f"{Path(file).stem}-{number}"
        if (not names or name in names) and (DATA / file).exists():
            yield name, face_region(read(DATA / file).parts[number - 1])


def main() -> None:
    titles = ("share", "dev/tol", "before", "after", "points", "new", "sine", "cpu s", "ok")
    print(f"{'shape':<20}" + "".join(f"{title:>10}" for title in titles))
    for name, region in regions(sys.argv[1:]):
        (u0, u1), (v0, v1) = region.box
        points = region.surface.grid(np.linspace(u0, u1, 33), np.linspace(v0, v1, 33)).reshape(-1, 3)
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        for share in SHARES:
            start = time.process_time()
            made = reparametrize(region, share * size)
            seconds = time.process_time() - start
            good = made.converged and (made.defect_before <= 0.5 or made.defect_after <= 0.1 * made.defect_before)
            before, after = (f"{a}x{b}" for a, b in (made.control_points_before, made.control_points_after))
            print(
                f"{name:<20}{share:>10.0e}{made.deviation / made.tolerance:>10.2f}{made.defect_before:>10.3g}"
                f"{made.defect_after:>10.2g}{before:>10}{after:>10}{made.least_sine:>10.3f}{seconds:>10.2f}"
                f"{'yes' if good else 'NO':>10}",
                flush=True,
            )


if __name__ == "__main__":
    main()
