"""Sites of one direction: halved where interpolation along it strays, taken out where it can do without.

Interpolation on a tensor grid errs by what each direction errs alone, nearly. So each is judged by itself, on lines
across the whole region: by how far it leaves the surface along its normal, and by how far it slips along the surface,
which is what would spoil the parametrisation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.knots import between
from patchwright.reparam.block_cubic import FEWEST, BlockCubic
from patchwright.reparam.chart import Chart
from patchwright.reparam.defect import NO_LENGTH, STEPS

SLIP = 0.01  # of an equal step: how far a point may slip along the surface
PER_SPAN = 4  # samples
LINES = 3 * STEPS // 2  # across
MOST_SITES = 240
ROUNDS = 12


@dataclass(frozen=True, slots=True, eq=False)
class Use:
    """One region's use of a direction: its chart, which of its parameters it is, and whether it runs backwards."""

    chart: Chart
    axis: int
    backwards: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """Points on lines along a direction, at sites and at samples."""

    at: Array
    exact: Array
    """(k, l, 3)"""
    normal: Array
    values: Array
    """(sites, l, 3)"""
    slack: Array
    """(l,) how far points of each line may slip."""


def refined(sites: Array, breaks: Array, uses: Sequence[Use], tolerance: float) -> tuple[Array, bool]:
    """The sites halved until every use keeps within the tolerance, and whether they do."""
    for _ in range(ROUNDS):
        worst = np.zeros(len(sites) - 1)
        middle = 0.5 * (sites[1:] + sites[:-1])
        for use in uses:
            lines = _lines_of(use, sites)
            error = _errors(BlockCubic(sites, breaks), lines, tolerance).reshape(len(sites) - 1, PER_SPAN)
            worst = np.maximum(worst, error.max(axis=1))
        bad = worst > 1.0
        if not bad.any():
            return sites, True
        if len(sites) + int(bad.sum()) > MOST_SITES:
            return sites, False
        sites = np.sort(np.concatenate((sites, middle[bad])))
    return sites, False


def thinned(sites: Array, breaks: Array, uses: Sequence[Use], tolerance: float) -> Array:
    """The sites without those that are not needed, the least needed tried first; breaks stay."""
    lines = [_lines_of(use, sites) for use in uses]
    spans = len(sites) - 1
    error = np.zeros(spans)
    for one in lines:
        error = np.maximum(
            error, _errors(BlockCubic(sites, breaks), one, tolerance).reshape(spans, PER_SPAN).max(axis=1)
        )
    need = np.maximum(error[:-1], error[1:])
    keep = np.ones(len(sites), dtype=bool)
    fixed = np.isin(sites, breaks)
    for k in (np.argsort(need) + 1).tolist():
        if fixed[k]:
            continue
        keep[k] = False
        left = BlockCubic(sites[keep], breaks)
        enough = all(b - a + 1 >= FEWEST for a, b in left.blocks)
        if not enough or any(_errors(left, one, tolerance, keep).max() > 1.0 for one in lines):
            keep[k] = True
    return sites[keep]


def _lines_of(use: Use, sites: Array) -> _Lines:
    at, across = between(sites, PER_SPAN), np.linspace(0.0, 1.0, LINES)

    def on_lines(x: Array, normals: bool = False) -> Array:
        x = 1.0 - x if use.backwards else x
        call = use.chart.normals if normals else use.chart.points
        return call(x, across) if use.axis == 0 else call(across, x).swapaxes(0, 1)

    exact, values = on_lines(at), on_lines(sites)
    length = np.linalg.norm(np.diff(values, axis=0), axis=2).sum(axis=0)
    slack = np.where(length > NO_LENGTH * use.chart.region.size, SLIP * length / STEPS, np.inf)
    return _Lines(at, exact, on_lines(at, normals=True), values, slack)


def _errors(cubic: BlockCubic, lines: _Lines, tolerance: float, keep: Array | None = None) -> Array:
    """(k,) the error at every sample, in parts of what is allowed."""
    off = cubic(lines.values if keep is None else lines.values[keep], lines.at) - lines.exact
    height = (off * lines.normal).sum(axis=2)
    slip = np.linalg.norm(off - height[..., None] * lines.normal, axis=2)
    return np.asarray(np.maximum(np.abs(height) / tolerance, slip / lines.slack).max(axis=1))
