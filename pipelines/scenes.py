"""Scenes: what a picture shows, as plain arrays, and their drawing in a child process."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.triangulation import Triangulation

SECONDS = 180.0  # a picture that takes longer is given up


@dataclass(slots=True)
class Scene:
    """One picture under construction: layers over a box."""

    path: Path
    title: str
    box: Array
    layers: list[dict[str, Any]] = field(default_factory=list)
    arrays: dict[str, Any] = field(default_factory=dict)
    direction: tuple[float, float, float] | None = None
    """From the model to the eye; None for the usual one."""

    def surface(
        self, triangulation: Triangulation, *, values: Any = None, colours: Any = None, **options: Any
    ) -> Scene:
        """Triangles in one colour, by `values` (m,) or by `colours` (m, 3) uint8."""
        key = f"{self.path.name}.{len(self.layers)}"
        self.arrays[f"{key}.vertices"] = triangulation.vertices
        self.arrays[f"{key}.triangles"] = triangulation.triangles
        if values is not None:
            self.arrays[f"{key}.values"] = np.asarray(values)
        if colours is not None:
            self.arrays[f"{key}.colours"] = np.asarray(colours, dtype=np.uint8)
        self.layers.append({"kind": "surface", "key": key, **options})
        return self

    def lines(self, segments: Array, **options: Any) -> Scene:
        """Line segments (k, 2, 3)."""
        return self._marks("lines", segments.reshape(-1, 3), options)

    def points(self, points: Array, **options: Any) -> Scene:
        """Dots (k, 3)."""
        return self._marks("points", points.reshape(-1, 3), options)

    def _marks(self, kind: str, points: Array, options: dict[str, Any]) -> Scene:
        key = f"{self.path.name}.{len(self.layers)}"
        self.arrays[f"{key}.points"] = points
        self.layers.append({"kind": kind, "key": key, **options})
        return self


def draw_scenes(scenes: list[Scene]) -> str | None:
    """Draw all scenes; returns None, or the sentence that says why there are no pictures."""
    listing: list[dict[str, Any]] = [
        {
            "path": str(s.path),
            "title": s.title,
            "box": np.asarray(s.box).tolist(),
            "layers": s.layers,
            **({} if s.direction is None else {"direction": s.direction}),
        }
        for s in scenes
    ]
    arrays: dict[str, Any] = {}
    for scene in scenes:
        arrays.update(scene.arrays)
    return draw_listing(listing, arrays, [s.path for s in scenes])


def draw_listing(listing: list[dict[str, Any]], arrays: dict[str, Any], paths: list[Path]) -> str | None:
    """Draw pictures described by a listing and its arrays, each to its path; None or why there are none."""
    if not listing:
        return None
    for path in paths:
        path.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        archive = Path(folder) / "scenes.npz"
        np.savez(archive, scenes=np.array(json.dumps(listing)), **arrays)
        command = [sys.executable, "-m", "patchwright.pipelines.view", str(archive)]
        try:
            done = subprocess.run(command, capture_output=True, timeout=SECONDS, check=False)
        except subprocess.TimeoutExpired:
            return f"no pictures: drawing took longer than {SECONDS:.0f} s"
    missing = [path.name for path in paths if not path.exists()]
    if missing:
        return f"no pictures ({', '.join(missing)}): off-screen drawing failed with exit code {done.returncode}"
    return None
