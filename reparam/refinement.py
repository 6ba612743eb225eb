"""Sites of one direction: halved where interpolation along it strays, taken out where it can do without.

Interpolation on a tensor grid errs by what each direction errs alone, nearly. So each is judged by itself, on lines
across the whole region: by how far it leaves the surface along its normal, by how far it slips along the surface,
which is what would spoil the parametrisation, and on the sides by how far it leaves the side.
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
TIES = 6  # digits: needs that agree in them are equal, whatever their round-off


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
    for k in (np.argsort(np.round(need, TIES), kind="stable") + 1).tolist():
        if fixed[k]:
            continue
        keep[k] = False
        left = BlockCubic(sites[keep], breaks)
        enough = all(b - a + 1 >= FEWEST for a, b in left.blocks)
        if not enough or any(_errors(left, one, tolerance, keep).max() > 1.0 for one in lines):
            keep[k] = True
    return sites[keep]


def errors_at(use: Use, sites: Array, breaks: Array, at: Array, across: Array) -> Array:
    """(k,) how far interpolation along the direction strays at single places, in the region's own sense.

    Along the normal inside, off the side on a side; `at` (k,) and `across` (k,) are parameters, sites and breaks too.
    """
    cubic, k = BlockCubic(sites, breaks), np.arange(len(at))

    def on_lines(x: Array) -> Array:
        return use.chart.points(x, across) if use.axis == 0 else use.chart.points(across, x).swapaxes(0, 1)

    values = on_lines(sites)
    off = (cubic(values, at) - on_lines(at))[k, k]
    tangent = cubic(values, at, 1)[k, k]
    unit = tangent / np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), np.finfo(float).tiny)
    beside = np.linalg.norm(off - (off * unit).sum(axis=1, keepdims=True) * unit, axis=1)
    normal = use.chart.normals(*((at, across) if use.axis == 0 else (across, at)))
    height = np.abs((off * (normal if use.axis == 0 else normal.swapaxes(0, 1))[k, k]).sum(axis=1))
    return np.asarray(np.where((across == 0.0) | (across == 1.0), beside, height))


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
    values = lines.values if keep is None else lines.values[keep]
    off = cubic(values, lines.at) - lines.exact
    height = (off * lines.normal).sum(axis=2)
    slip = np.linalg.norm(off - height[..., None] * lines.normal, axis=2)
    error = np.maximum(np.abs(height) / tolerance, slip / lines.slack).max(axis=1)
    tangent = cubic(values[:, [0, -1]], lines.at, 1)
    unit = tangent / np.maximum(np.linalg.norm(tangent, axis=2, keepdims=True), np.finfo(float).tiny)
    beside = off[:, [0, -1]] - (off[:, [0, -1]] * unit).sum(axis=2, keepdims=True) * unit
    return np.asarray(np.maximum(error, np.linalg.norm(beside, axis=2).max(axis=1) / tolerance))
