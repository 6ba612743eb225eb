"""STEP read and tessellated, and networks written, beside build123d on the same files in one run.

usage: python benchmarks/bench_step.py [--faces 300] [--big]

Both sides read the file into faces and tessellate with the same angle into about as many triangles: build123d takes the
deflection relative to the edges, so ours is lowered until we make no fewer. Ours also carries surfaces, loops,
topology, (u, v) and the transport out of the child process. Imports and the worker's start are excluded on both sides;
the best of three is shown. Without build123d there is no peer.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
DATA = Path(os.environ.get("PATCHWRIGHT_DATA", ROOT.parent / "shared" / "data"))
ANGLE = 0.25


def best(work: Callable[[], object], repeats: int = 3) -> float:
    """Least wall time in seconds."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return min(times)


def main() -> None:
    from oracles_cad import torus

    from patchwright.models.io import write
    from patchwright.models.io.step import read

    options = argparse.ArgumentParser()
    options.add_argument("--faces", type=int, default=300)
    options.add_argument("--big", action="store_true", help="also write 3,000 faces as STEP and IGES")
    chosen = options.parse_args()
    warnings.simplefilter("ignore")
    folder = Path(tempfile.mkdtemp())
    made = folder / "network.step"
    write(made, torus(chosen.faces // 15, 15, count=19))
    files = [made, *(DATA / n for n in ("turbine_part.stp", "featuretype.step", "k1_loose_shells.stp"))]
    try:
        import build123d
    except ImportError:
        build123d = None
        print("build123d is not installed: no peer")
    for path in files:
        if not path.exists():
            continue
        model = read(path)
        deflection = 2e-4 * model.diagonal
        print(f"{path.name}: {path.stat().st_size / 2**20:.1f} MB, {len(model.parts)} faces")
        if build123d is not None:

            def peer(path: Path = path, deflection: float = deflection) -> tuple[object, list[object]]:
                return build123d.import_step(path).tessellate(deflection, ANGLE)

            wanted = len(peer()[1])
            deflection *= 8.0
            while len(read(path, deflection=deflection, angle=ANGLE).triangulation) < wanted:
                deflection /= 1.1
            theirs = best(peer)
            print(f"  build123d {theirs:.2f} s, {wanted} triangles")
        ours = best(lambda path=path, d=deflection: read(path, deflection=d, angle=ANGLE))  # type: ignore[misc]
        count = len(read(path, deflection=deflection, angle=ANGLE).triangulation)
        ratio = "" if build123d is None else f", ratio {ours / theirs:.2f}"
        print(f"  patchwright {ours:.2f} s, {count} triangles{ratio}")
    if chosen.big:
        network = torus(60, 50)
        for suffix in (".step", ".igs"):
            taken = best(lambda s=suffix: write(folder / f"big{s}", network), 1)  # type: ignore[misc]
            print(f"3,000 patches of 7 x 7 written as {suffix}: {taken:.1f} s")


if __name__ == "__main__":
    main()
