"""How the cost of a repair grows: processor time and memory of each stage at 1e4, 1e5 and 1e6 triangles.

    python benchmarks/table_growth.py [--sizes 1e4 1e5 1e6] [--whole] [--limit CPU-SECONDS] [--json FILE]

The model is the demonstration aircraft (`patchwright demo`) with finer and finer triangles: four overlapping bodies, a
slit round the fuselage, 1 % of the triangles missing, every triangle with corners of its own, moved within a ball whose
radius follows the triangles' size (1e-4 of the length at 1e4 triangles). Diagnosis and mender by their stages; with
`--whole` the layout, the fit, what else `repair` does and the writing of STEP as well. Each size runs in a process of
its own that is stopped at the limit, after a run at the smallest size so that nothing is compiled in the figures.

Columns per size: processor seconds, and the growth against the size before; the last row gives the largest resident
memory. The bar: at most twelve times for ten times the triangles.
"""

from __future__ import annotations

import argparse
import json
import resource
import tempfile
import time
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from rows import limit_processor, print_row, row_of_child

LEAST = 1e4  # triangles at which the jitter is `JITTER`
JITTER = 1e-4  # of the length
WARM = 3_000  # triangles
BAR = 12.0


def dirty_aircraft(triangles: int) -> Any:
    """The demonstration aircraft with about so many triangles, its jitter scaled with their size."""
    from patchwright.models import Assembly
    from patchwright.models.samples.aircraft import aircraft
    from patchwright.models.samples.cutting import slit
    from patchwright.models.samples.defects import damage
    from patchwright.models.samples.demo import STATION, WIDTH
    from patchwright.models.samples.soup import missing_triangles, unmerged

    sample = aircraft(triangles=triangles)
    length = float(np.ptp(sample.assembly.parts[0].triangulation.bounds[:, 0]))
    place = (STATION * length, 0.0, 0.0)
    steps = (
        partial(slit, point=place, normal=(1.0, 0.0, 0.0), width=WIDTH * length, only=("fuselage",)),
        partial(missing_triangles, share=0.01),
        partial(unmerged, radius=JITTER * length * min(1.0, np.sqrt(LEAST / triangles))),
    )
    damaged = damage(sample.assembly.triangulation, steps, seed=1)
    return Assembly(damaged.assembly.parts, unit=sample.assembly.unit, source=f"aircraft of {triangles} triangles")


class Clock:
    """A `progress` that adds up the processor time between the labels it is called with."""

    def __init__(self, group: str) -> None:
        self.group, self.label, self.since = group, "start", time.process_time()
        self.seconds: dict[str, float] = {}

    def __call__(self, label: str, share: float) -> None:
        now = time.process_time()
        name = f"{self.group}: {self.label}"
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self.since
        self.label, self.since = label, now

    def stop(self) -> dict[str, float]:
        """All times, and their sum under the name of the group."""
        self("", 1.0)
        return {self.group: sum(self.seconds.values()), **self.seconds}


def measured(triangles: int, whole: bool) -> dict[str, Any]:
    """Processor seconds by stage, and what came out."""
    from patchwright.models import Tolerance
    from patchwright.models.io import write
    from patchwright.repair import diagnose, repair
    from patchwright.repair.mender.mend import mend

    model = dirty_aircraft(triangles)
    tolerance = Tolerance.of(model)
    clock = Clock("diagnose")
    found = diagnose(model, tolerance=tolerance, progress=clock)
    seconds = clock.stop()
    result: dict[str, Any] = {"defects": len(found.defects)}
    if whole:
        clock = Clock("repair")
        repaired = repair(model, tolerance=tolerance, diagnosis=found, progress=clock)
        seconds |= clock.stop()
        clock = Clock("write STEP")
        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder, "repaired.step"), repaired.to_assembly())
        seconds |= clock.stop()
        result["verdict"] = str(repaired.verdict.value)
        result["coverage"] = 0.0 if repaired.deviation is None else repaired.deviation.coverage
    else:
        clock = Clock("mend")
        mended = mend(model.triangulation, tolerance, progress=clock)
        seconds |= clock.stop()
        result["closed"] = bool(mended.closed)
        result["problems"] = [problem.message for problem in mended.problems]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return {"triangles": len(model.triangulation), "seconds": seconds, "MB": memory, **result}


def one(triangles: int, whole: bool, limit: float) -> dict[str, Any]:
    """`measured` in a process of its own."""
    return row_of_child(__file__, ["--one", str(triangles), *["--whole"] * whole], limit)


def table(rows: list[dict[str, Any]]) -> str:
    names = list(dict.fromkeys(name for row in rows for name in row.get("seconds", {})))
    lines = ["stage".ljust(36) + "".join(f"{row.get('triangles', 0):>12d}" + " " * 8 for row in rows)]
    for name in names:
        cells, before = "", 0.0
        for row in rows:
            value = row.get("seconds", {}).get(name)
            growth = f"x{value / before:.1f}" if value is not None and before > 0.0 else ""
            cells += (f"{value:>12.2f}" if value is not None else "-".rjust(12)) + growth.rjust(8)
            before = value or 0.0
        lines.append(name[:36].ljust(36) + cells)
    lines.append("MB".ljust(36) + "".join(f"{row.get('MB', 0.0):>12.0f}" + " " * 8 for row in rows))
    lines += [f"{row.get('triangles', '?')}: " + str({k: v for k, v in row.items() if k not in ("seconds", "MB")})
              for row in rows]  # fmt: skip
    worst = [
        (b["seconds"][name] / max(a["seconds"][name], 1e-9), name)
        for a, b in pairwise(rows)
        for name in b.get("seconds", {})
        if ":" not in name and name in a.get("seconds", {})
    ]
    if worst:
        lines.append(f"largest growth of a whole step: {max(worst)[0]:.1f} ({max(worst)[1]}); bar {BAR:g}")
    return "\n".join(lines)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--sizes", nargs="*", type=float, default=[1e4, 1e5, 1e6])
    arguments.add_argument("--whole", action="store_true", help="to STEP: layout, fit and writing too")
    arguments.add_argument("--limit", type=float, default=1800.0, help="seconds of processor time per size")
    arguments.add_argument("--json", type=Path, help="write the figures there too")
    arguments.add_argument("--one", type=int, help=argparse.SUPPRESS)
    asked = arguments.parse_args()
    if asked.one:
        limit_processor(asked.limit)
        measured(WARM, asked.whole)
        print_row(measured(asked.one, asked.whole))
        return
    rows = [one(int(size), asked.whole, asked.limit) for size in asked.sizes]
    print(table(rows))
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
