"""Damaged CAD files for `table_cad_healing.py`: which model, what is done to which of its faces, how large it is.

Every model is damaged in every way but those of `UNMADE`: one face missing; three stored twice; three with their
normals on the other side; no edge shared at all; three cut back by 1 % of the diagonal on their own surface, scaled by
1 %, shifted by 0.3 %. The faces are drawn by chance from those wider than the damage, the same at every run.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("PATCHWRIGHT_DATA", HERE.parent.parent / "shared" / "data"))
sys.path.insert(0, str(HERE.parent / "tests"))

MODELS = ("featuretype.step", "turbine_part.stp", "nacelle.stp", "filleted box", "lofted wing")
SIZES = {"missing": 0.0, "duplicated": 0.0, "flipped": 0.0, "unshared": 0.0, "cut back": 1e-2, "scaled": 1e-2,
         "displaced": 3e-3}  # fmt: skip
UNMADE = {  # why there is no such file
    "nacelle.stp: cut back": "the kernel dies cutting the tube round an edge off a face",
    "lofted wing: cut back": "tubes as wide as 1 % of the diagonal leave several pieces of a face of the thin profile",
}
ROOM = 8.0  # times the damage: a face narrower than this has no counterpart left
FEW = 8  # faces: of so few, one is damaged


def names() -> list[str]:
    """All cases, "model: damage"."""
    every = [f"{model}: {kind}" for model in MODELS for kind in SIZES]
    return [name for name in every if name not in UNMADE]


def made(name: str, folder: Path) -> tuple[Path, Path, float]:
    """The damaged file, the undamaged one, and the width of the damage as a length."""
    from oracles_cad_damage import faces_of, read_shape, written
    from oracles_cad_solids import filleted_box, lofted_wing

    from patchwright.models.io import read

    model, kind = name.split(": ")
    whole = DATA / model
    if not whole.suffix:
        shape = {"filleted box": filleted_box, "lofted wing": lofted_wing}[model]()
        whole = written(folder / "whole.step", faces_of(shape), set())
    faces = faces_of(read_shape(whole))
    size = SIZES[kind] * read(whole).diagonal
    which = _chosen(faces, size)
    if kind == "missing":
        kept = [face for k, face in enumerate(faces) if k != which[0]]
        return written(folder / "damaged.step", kept, set()), whole, size
    if kind == "duplicated":
        twice = [*faces, *(_damaged(faces[k], "unshared", size, k) for k in which)]
        return written(folder / "damaged.step", twice, set(range(len(faces), len(twice)))), whole, size
    hit = list(range(len(faces))) if kind == "unshared" else which
    damaged = [_damaged(face, kind, size, k) if k in hit else face for k, face in enumerate(faces)]
    return written(folder / "damaged.step", damaged, set(hit)), whole, size


def _chosen(faces: list[Any], size: float) -> list[int]:
    """Numbers of three faces, or one of few, that are wide enough."""
    from oracles_cad_damage import area_of, perimeter_of

    width = np.array([2.0 * area_of(face) / perimeter_of(face) for face in faces])
    wide = np.flatnonzero(width >= min(ROOM * size, width.max()))
    rng = np.random.default_rng(len(faces))
    return sorted(rng.choice(wide, min(len(wide), 1 if len(faces) < FEW else 3), replace=False).tolist())


def _damaged(face: Any, kind: str, size: float, seed: int) -> Any:
    from oracles_cad_damage import cut_back, reversed_face, shifted, shrunk, with_own_edges

    if kind == "flipped":
        return reversed_face(face)
    if kind == "unshared":
        return with_own_edges(face)
    if kind == "cut back":
        return cut_back(face, size)
    if kind == "scaled":
        return shrunk(face, 1.0 - SIZES[kind])
    vector = np.random.default_rng(seed).normal(size=3)
    return shifted(face, size * vector / np.linalg.norm(vector))
