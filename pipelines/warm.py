"""The first run compiles the kernels: said on screen, and half of it done in a second process meanwhile.

    python -m patchwright.pipelines.warm

compiles what laying out and fitting need, on a cube; the command line starts it beside the stages that come before.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from patchwright.pipelines.progress import Terminal

if TYPE_CHECKING:
    from patchwright.models.triangulation import Triangulation

WITNESS = "patchwright.repair.layout._remesh_kernel"  # compiled late in every repair of a triangulation
SECTIONS = "patchwright.ssi._subdivision_kernel"  # compiled by every intersection of free-form surfaces
MESH_SECTIONS = "patchwright.ssi._mesh_surface_kernel"  # by every intersection of a mesh with a curved surface
_started = False  # in this process


def is_cold(witness: str = WITNESS) -> bool:
    """Whether the kernels of a module have not been compiled on this machine since their source changed."""
    spec = find_spec(witness)
    if spec is None or spec.origin is None:
        return False
    source = Path(spec.origin)
    places = [source.parent / "__pycache__"]
    if "NUMBA_CACHE_DIR" in os.environ:
        places = list(Path(os.environ["NUMBA_CACHE_DIR"]).glob("*"))
    made = [index.stat().st_mtime for place in places for index in place.glob(f"{source.stem}.*.nbi")]
    return not made or max(made) < source.stat().st_mtime


def start(terminal: Terminal) -> None:
    """On a cold machine: say so once, and compile the later stages' kernels in a second process."""
    global _started
    if _started or not is_cold():
        return
    _started = True
    spare_collections()
    terminal.line("  compiling kernels for this machine: about a minute, this once")
    command = [sys.executable, "-m", "patchwright.pipelines.warm"]
    nothing = subprocess.DEVNULL
    subprocess.Popen(command, stdin=nothing, stdout=nothing, stderr=nothing)


def announce_sections(terminal: Terminal, witness: str = SECTIONS) -> None:
    """On a cold machine: say that intersecting surfaces, or meshes with them, compiles its kernels first."""
    if is_cold(witness):
        spare_collections()
        how = "one to two minutes for surfaces" if witness == SECTIONS else "about a minute for meshes with surfaces"
        terminal.line(f"  compiling kernels for this machine: {how}, this once")


def spare_collections() -> None:
    """Collect garbage less often: the compiler makes many objects and spent nearly a tenth of its time collecting."""
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)


def main() -> None:
    """Lay out and fit a small noisy torus and measure its patches, which needs every kernel of those stages.

    What the first process needs first, evaluation and trees, comes last here: by then it is there to be loaded.
    """
    spare_collections()
    import numpy as np

    from patchwright.models.assembly import Assembly, Part
    from patchwright.models.cad.seams import edge_deviation
    from patchwright.models.tolerance import Tolerance
    from patchwright.models.tree import Tree
    from patchwright.models.triangulation import Triangulation
    from patchwright.repair.layout.blocks import single_blocks
    from patchwright.repair.layout.quad_layout import quad_layout
    from patchwright.repair.patches.block_faces import block_faces
    from patchwright.repair.patches.patch_fit import Target
    from patchwright.repair.patches.resurface import resurface

    body = _noisy_torus()
    layout = quad_layout(body, target=60)
    target = Target(Tree.of(body), np.zeros(len(body), dtype=bool))
    network = resurface(layout, target, Tolerance.of(body, fit=body.diagonal))
    nothing = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    faces = block_faces(network, single_blocks(layout))
    parts = tuple(Part("", nothing, surface=surface) for surface in faces.surfaces)
    edge_deviation(Assembly(parts, topology=faces.topology))


def _noisy_torus(rows: int = 24, columns: int = 48) -> Triangulation:
    import numpy as np

    from patchwright.models.triangulation import Triangulation

    i, j = (k.reshape(-1) for k in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    a, b = 2.0 * np.pi * i / rows, 2.0 * np.pi * j / columns
    away = 3.0 + np.cos(a)
    points = np.stack([away * np.cos(b), away * np.sin(b), np.sin(a)], axis=1)
    points += np.random.default_rng(1).normal(scale=0.02, size=points.shape)
    up, on = (i + 1) % rows, (j + 1) % columns
    here, above, across, beside = i * columns + j, up * columns + j, up * columns + on, i * columns + on
    triangles = np.concatenate([np.stack([here, beside, across], axis=1), np.stack([here, across, above], axis=1)])
    return Triangulation(points, triangles)


if __name__ == "__main__":
    main()
