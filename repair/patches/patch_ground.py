"""The geometry under single patches: round-off welded once, open sheets turned to face each patch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.assembly import Assembly
from patchwright.models.errors import ParameterError
from patchwright.models.tolerance import Tolerance
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.ground.true_ground import TrueGround, TrueSurfaces
from patchwright.repair.mender.weld import weld, weld_distance
from patchwright.repair.patches.coons import offset_distance, offset_normals
from patchwright.repair.patches.facing import facing
from patchwright.repair.patches.patch_sides import Sides
from patchwright.repair.patches.projection import Ground

SAMPLES = 33  # a side of the grid that asks the geometry which way it faces


@dataclass(frozen=True, slots=True, eq=False)
class PatchGround:
    """A welded geometry, as many triangles as it came with, and the true surfaces behind them where it is CAD."""

    body: Triangulation
    true: TrueSurfaces | None

    @classmethod
    def of(cls, geometry: Assembly | Triangulation) -> PatchGround:
        """Weld what round-off separates.

        Raises
        ------
        ParameterError : a geometry without triangles.
        """
        model = geometry if isinstance(geometry, Assembly) else Assembly.of(geometry)
        raw = model.triangulation
        if not len(raw):
            raise ParameterError(f"{model.source or 'the geometry'} has no triangles to lay a patch on")
        body = weld(raw, weld_distance(raw, Tolerance.of(model))[0]).triangulation
        return cls(body, TrueSurfaces.of(model))

    def under(self, sides: Sides, offset: float | None = None) -> tuple[Ground, int]:
        """The ground to project onto, its open sheets facing as the patch does, and the sign of the patch's normals.

        Parameters
        ----------
        offset : half the length of the probes that ask; default an eighth of the perimeter (HJR 7)
        """
        shares = np.linspace(0.0, 1.0, SAMPLES)
        coons = sides.coons(shares, shares)
        reach = float(offset_distance(coons)) if offset is None else offset
        points, normals = (x[1:-1, 1:-1].reshape(-1, 3) for x in (coons, offset_normals(coons)))
        body, sign = facing(self.body, points, normals, reach)
        tree = Tree.of(body)
        if self.true is None:
            return tree, sign
        return TrueGround.of(tree, np.arange(len(body)), self.true), sign
