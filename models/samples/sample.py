"""`Sample`: a shape made in code, clean, with its NURBS surfaces and its truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly, Part
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.truth import Truth
from patchwright.models.triangulation import Triangulation


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """A demonstration shape.

    Parameters
    ----------
    name : the sample's name
    bodies : its bodies, overlapping where the shape is an unjoined assembly
    assembly : one part per body, tessellated, clean: closed and outward oriented where the body is closed
    truth : what a repaired shape is measured against
    """

    name: str
    bodies: tuple[Body, ...]
    assembly: Assembly
    truth: Truth

    @classmethod
    def of(
        cls,
        name: str,
        bodies: tuple[Body, ...],
        *,
        triangles: int | None = None,
        unit: str = "m",
        exact_distance: Callable[[Array], Array] | None = None,
        exact_volume: float | None = None,
        exact_area: float | None = None,
    ) -> Sample:
        """A sample tessellated along its bodies' lines, or with about `triangles` triangles in all."""
        parts = [b.tessellate() for b in bodies]
        if triangles is not None:
            density = float(np.sqrt(triangles / sum(map(len, parts))))
            parts = [b.tessellate(density=density) for b in bodies]
        plain = [Triangulation(t.vertices, t.triangles, uv=t.uv) for t in parts]
        assembly = Assembly(tuple(Part(b.name, t) for b, t in zip(bodies, plain, strict=True)), unit=unit, source=name)
        truth = Truth(bodies, exact_distance=exact_distance, exact_volume=exact_volume, exact_area=exact_area)
        return cls(name, bodies, assembly, truth)

    @property
    def surfaces(self) -> dict[str, dict[str, NurbsSurface]]:
        """The NURBS surfaces: body name -> face name -> surface."""
        return {b.name: dict(zip(b.faces, b.surfaces, strict=True)) for b in self.bodies}

    @property
    def faces(self) -> Assembly:
        """The sample as CAD: one part per surface, with its tessellation, the body's name in `Part.body`."""
        parts = []
        for body in self.bodies:
            whole = body.tessellate()
            for i, (name, surface) in enumerate(zip(body.faces, body.surfaces, strict=True)):
                piece = whole.take(whole.tags == i).compact()
                mesh = Triangulation(piece.vertices, piece.triangles, uv=piece.uv)
                parts.append(Part(f"{body.name}/{name}", mesh, surface=surface, body=body.name if body.closed else ""))
        return Assembly(tuple(parts), unit=self.assembly.unit, source=self.name)
