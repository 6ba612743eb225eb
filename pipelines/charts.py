"""Charts: curves over axes as plain arrays, drawn beside the scenes by the same child process."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.pipelines.scenes import draw_listing

COLOURS = ("#1f5fa8", "#c8501e", "#2d8a4e", "#8a3fa0", "#a07a10", "#c02060", "#444444")


@dataclass(slots=True)
class Chart:
    """One pair of axes under construction."""

    title: str
    equal: bool = False
    """Whether both axes have one scale."""
    labels: tuple[str, str] = ("", "")
    legend: bool = True
    window: tuple[tuple[float, float], tuple[float, float]] | None = None
    """What is shown, (x, y) ranges; None: everything."""
    layers: list[dict[str, Any]] = field(default_factory=list)
    arrays: list[Array] = field(default_factory=list)

    def line(self, points: Array, label: str, colour: str, *, width: float = 2.0, style: str = "-") -> Chart:
        """A polyline (k, 2); the style is "-", "--" or ":"."""
        return self._add("line", points, label=label, colour=colour, width=width, style=style)

    def dots(self, points: Array, label: str, colour: str, *, size: float = 9.0) -> Chart:
        """Dots (k, 2)."""
        return self._add("dots", points, label=label, colour=colour, size=size)

    def bars(self, heights: Array, names: tuple[str, ...], colour: str) -> Chart:
        """Bars of heights (k,), named below."""
        at = np.stack((np.arange(len(heights), dtype=np.float64), heights), axis=1)
        return self._add("bars", at, names=list(names), colour=colour, label="")

    def _add(self, kind: str, points: Array, **options: Any) -> Chart:
        self.layers.append({"kind": kind, **options})
        self.arrays.append(np.asarray(points, dtype=np.float64))
        return self


@dataclass(frozen=True, slots=True)
class ChartSheet:
    """Charts in rows of `columns` on one picture, each of `size` pixels."""

    path: Path
    charts: tuple[Chart, ...]
    columns: int
    size: tuple[int, int] = (700, 520)


def draw_charts(sheets: list[ChartSheet]) -> str | None:
    """Draw all sheets; returns None, or the sentence that says why there are no pictures."""
    listing: list[dict[str, Any]] = []
    arrays: dict[str, Any] = {}
    for sheet in sheets:
        charts = []
        for i, chart in enumerate(sheet.charts):
            layers = []
            for k, (layer, points) in enumerate(zip(chart.layers, chart.arrays, strict=True)):
                key = f"{sheet.path.name}.{i}.{k}"
                arrays[key] = points
                layers.append({**layer, "key": key})
            charts.append(
                {
                    "title": chart.title, "labels": chart.labels, "layers": layers, "legend": chart.legend,
                    "ranges": _ranges(chart, sheet.size),
                }
            )  # fmt: skip
        listing.append({"path": str(sheet.path), "charts": charts, "columns": sheet.columns, "size": list(sheet.size)})
    return draw_listing(listing, arrays, [sheet.path for sheet in sheets])


def _ranges(chart: Chart, size: tuple[int, int]) -> list[list[float]]:
    """(x, y) ranges of everything drawn with a margin, widened to one scale where asked."""
    if chart.window is not None:
        return [list(axis) for axis in chart.window]
    everything = np.concatenate(chart.arrays)
    if any(layer["kind"] == "bars" for layer in chart.layers):
        everything = np.concatenate((everything, [[-0.6, 0.0], [everything[:, 0].max() + 0.6, 0.0]]))
    low, high = everything.min(axis=0), everything.max(axis=0)
    middle, half = (low + high) / 2.0, np.maximum((high - low) / 2.0, 1e-12 * np.maximum(1.0, np.abs(high))) * 1.08
    if chart.legend:
        middle[0], half[0] = middle[0] + 0.06 * half[0], 1.06 * half[0]  # room for it on the right
    if chart.equal:
        per_pixel = (half / np.array(size)).max()
        half = per_pixel * np.array(size)
    return [[float(middle[k] - half[k]), float(middle[k] + half[k])] for k in (0, 1)]
