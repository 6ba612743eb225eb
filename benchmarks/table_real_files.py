"""Repair of real files, one row each: what came out, how far it strays, what was invented, time and memory.

    python benchmarks/table_real_files.py [FILE or FOLDER ...] [--only mesh|cad] [--limit CPU-SECONDS] [--json FILE]

Without arguments: every surface model in `PATCHWRIGHT_DATA` (default ../shared/data). Each file is diagnosed, repaired
with the default options, written as STEP and STL and read back, in a process of its own that is stopped at the limit.

Columns: lengths are shares of the model's diagonal; `gap` and `angle` are measured surface to surface on the seams of
the STEP file read back, the angle (degrees) is the 99th percentile of the seams below 30, `folds` counts seams above
150. `false` says that a model that diagnosis calls clean was changed. A row is usable when the model was not refused
and its files came back whole.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import tempfile
import time
from pathlib import Path

from rows import heading, limit_processor, line, print_row, row_of_child

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("PATCHWRIGHT_DATA", HERE.parent.parent / "shared" / "data"))
MESH = (".stl", ".obj", ".ply", ".off", ".tri")
CAD = (".stp", ".step", ".igs", ".iges")
COLUMNS = (
    ("file", "{:24s}"), ("verdict", "{:16s}"), ("in", "{:>7d}"), ("kept", "{:>7d}"), ("new", "{:>6d}"),
    ("median", "{:>8.1e}"), ("largest", "{:>8.1e}"), ("gap", "{:>8.1e}"), ("angle", "{:>6.2f}"), ("folds", "{:>5d}"),
    ("invented", "{:>8.2%}"), ("false", "{:>5s}"), ("cpu s", "{:>6.1f}"), ("MB", "{:>6.0f}"),
)  # fmt: skip


def kind(path: Path) -> str | None:
    """ "mesh", "cad" or None for what holds no surface model."""
    suffix = path.suffix.lower() if path.suffix.lower() != ".gz" else Path(path.stem).suffix.lower()
    return "mesh" if suffix in MESH else "cad" if suffix in CAD else None


def judge(path: Path) -> dict[str, object]:
    """One row of the table."""
    import numpy as np

    from patchwright.models.cad.seams import measure_seams
    from patchwright.models.io import read, write
    from patchwright.repair import diagnose, repair
    from patchwright.repair.result import Rung

    start = time.process_time()
    model = read(path)
    found = diagnose(model)
    repaired = repair(model, diagnosis=found)
    size = model.diagonal
    kept = [entry for entry in repaired.ledger if entry.what == "triangles kept"]
    row: dict[str, object] = {
        "verdict": repaired.verdict.value.replace("repaired with invented surface", "invented"),
        "in": len(model.parts) if model.is_cad else len(model.triangulation),
        "kept": sum(face.rung in (Rung.KEEP, Rung.WELD) for face in repaired.faces)
        if model.is_cad
        else sum(entry.count for entry in kept),
        "new": sum(face.rung not in (Rung.KEEP, Rung.WELD) for face in repaired.faces),
        "invented": float(repaired.invented),
        "why": "; ".join(problem.message for problem in repaired.problems),
        "defects": {d.kind: d.count for d in found.defects if d.severity != "info"},
    }
    if repaired.deviation is not None:
        sides = (repaired.deviation.input_to_output, repaired.deviation.output_to_input)
        row["median"] = max(side.median for side in sides) / size
        row["largest"] = max(side.largest for side in sides) / size
    wrong = found.clean and repaired.verdict != "clean"
    if not model.is_cad:
        corners = np.sort(model.triangulation.corners.reshape(-1, 9), axis=1)
        after = np.sort(repaired.triangulation.corners.reshape(-1, 9), axis=1)
        if repaired.verdict == "clean":
            wrong |= corners.shape != after.shape or not np.array_equal(
                np.unique(corners, axis=0), np.unique(after, axis=0)
            )
    row["false"] = "yes" if wrong else "no"
    if repaired.verdict != "refused":
        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder, "repaired.step"), repaired.to_assembly())
            write(Path(folder, "repaired.stl"), repaired.triangulation)
            back = read(Path(folder, "repaired.step"))
            solid = read(Path(folder, "repaired.stl"))
        seams = measure_seams(back, samples=8) if back.topology is not None else []
        angles = np.array([seam.angle for seam in seams])
        row["gap"] = max((seam.across for seam in seams), default=0.0) / size
        row["angle"] = float(np.percentile(angles[angles < 30.0], 99.0)) if (angles < 30.0).any() else 0.0
        row["folds"] = int((angles > 150.0).sum())
        row["usable"] = len(back.parts) == len(repaired.faces) and len(solid.triangulation) == len(
            repaired.triangulation
        )
    row["cpu s"] = time.process_time() - start
    row["MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return row


def judged(path: Path, limit: float) -> dict[str, object]:
    """`judge` in a process of its own; a row in any case."""
    row = row_of_child(__file__, ["--row", str(path)], limit)
    return {"verdict": row.pop("how").upper(), **row} if "how" in row else row


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("paths", nargs="*", type=Path)
    arguments.add_argument("--only", choices=["mesh", "cad"])
    arguments.add_argument("--limit", type=float, default=600.0, help="seconds of processor time per file")
    arguments.add_argument("--json", type=Path, help="write the rows there too")
    arguments.add_argument("--row", type=Path, help=argparse.SUPPRESS)
    asked = arguments.parse_args()
    if asked.row:
        limit_processor(asked.limit)
        print_row(judge(asked.row))
        return
    files = [f for p in asked.paths or [DATA] for f in (sorted(p.iterdir()) if p.is_dir() else [p])]
    files = [f for f in files if kind(f) and asked.only in (None, kind(f))]
    print(heading(COLUMNS))
    rows = []
    for path in files:
        rows.append({"file": path.name[:24], **judged(path, asked.limit)})
        print(line(rows[-1], COLUMNS), flush=True)
    usable = sum(bool(row.get("usable")) for row in rows)
    false = sum(row.get("false") == "yes" for row in rows)
    print(f"\n{usable} of {len(rows)} usable ({usable / max(1, len(rows)):.0%}), {false} false repairs")
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
