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

from patchwright.pipelines.progress import Terminal

WITNESS = "patchwright.repair._remesh_kernel"  # compiled late in every repair of a triangulation
_started = False  # in this process


def is_cold() -> bool:
    """Whether the kernels have not been compiled on this machine since their source changed."""
    spec = find_spec(WITNESS)
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


def spare_collections() -> None:
    """Collect garbage less often: the compiler makes many objects and spent nearly a tenth of its time collecting."""
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)


def main() -> None:
    """Lay out and fit a small noisy ball, which needs every kernel of those stages."""
    spare_collections()
    import numpy as np

    from patchwright.models.samples import sphere
    from patchwright.models.tolerance import Tolerance
    from patchwright.models.tree import Tree
    from patchwright.repair.patch_fit import Target
    from patchwright.repair.quad_layout import quad_layout
    from patchwright.repair.resurface import resurface

    body = sphere().assembly.triangulation
    target = Target(Tree.of(body), np.zeros(len(body), dtype=bool))
    resurface(quad_layout(body, target=60), target, Tolerance.of(body, fit=body.diagonal))


if __name__ == "__main__":
    main()
