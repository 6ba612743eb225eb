"""Gap filling judged: the default beside the paper's method and two general interpolators, by their largest error.

    python benchmarks/table_filling.py [--seeds N] [--json FILE]

Two functions on a 41 by 41 grid, one smooth and one with a crease; gaps of 5 to 40 % of the patch, in its middle, at
its border and in a corner of it, where the border itself is known as it is for every patch, and `beyond`: at the
border, which is not known either, so that the surface is continued into nothing. Noise 0, 1e-4 and 1e-3 (the worst of
N draws). `smooth` is the default, `hardy` the paper's local method (HJR 11-13); `local` is scipy's cubic radial basis
with 60 neighbours, `nearest` the nearest projection: what a mender without a method would do. `best` names the least
error. The verdict counts, for each place, the cases in which the default is no worse than the paper's method (5 % of
the error or one noise level apart is a draw) and gives the middle ratio of the two.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rows import heading, line

from patchwright.models.arrays import Array, BoolArray
from patchwright.repair.patches.filling import fill

SIDE = 41
WIDTHS = (0.05, 0.1, 0.2, 0.3, 0.4)
NOISES = (0.0, 1e-4, 1e-3)
NEIGHBOURS = 60
DRAW = 0.05
U, V = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE), indexing="ij")
FUNCTIONS = {
    "smooth": 0.15 * np.sin(2 * np.pi * U) * np.cos(np.pi * V) + 0.1 * U * V,  # design notes, section 6
    "creased": 0.2 * np.abs(U - 0.37 * V - 0.3) + 0.05 * np.cos(5 * V),
}


KNOWN: dict[str, Callable[[float], BoolArray]] = {  # where the function is known, by the width of the gap
    "middle": lambda width: np.asarray(np.abs(U - 0.5 + 0.1 * (V - 0.5)) >= width / 2),
    "border": lambda width: np.asarray((width <= U) | (U == 0)),
    "corner": lambda width: np.asarray((width <= U) | (width <= V) | (U == 0) | (V == 0)),
    "beyond": lambda width: np.asarray(width <= U),
}


def ours(method: str) -> Callable[[Array, BoolArray, float], Array]:
    return lambda data, found, noise: fill(data, found, method=method, noise=noise)[0]


def peer(kind: str) -> Callable[[Array, BoolArray, float], Array]:
    def filled(data: Array, found: BoolArray, noise: float) -> Array:
        from scipy.interpolate import NearestNDInterpolator, RBFInterpolator

        sites, missing = np.argwhere(found) / (SIDE - 1), np.argwhere(~found) / (SIDE - 1)
        out = data.copy()
        if kind == "local":
            out[~found] = RBFInterpolator(sites, data[found], neighbors=NEIGHBOURS, kernel="cubic")(missing)
        else:
            out[~found] = NearestNDInterpolator(sites, data[found])(missing)
        return out

    return filled


METHODS = {"smooth": ours("smooth"), "hardy": ours("hardy"), "local": peer("local"), "nearest": peer("nearest")}
COLUMNS = (
    ("function", "{:8s}"), ("gap", "{:>5.0%}"), ("at", "{:7s}"), ("noise", "{:>6.0e}"),
    *((name, "{:>9.5f}") for name in METHODS), ("best", "{:8s}"),
)  # fmt: skip


def judge(function: str, place: str, width: float, noise: float, seeds: int) -> dict[str, object]:
    """One row: the largest error of each method over the gap, the worst draw of the noise."""
    exact, found = FUNCTIONS[function], KNOWN[place](width)
    worst = dict.fromkeys(METHODS, 0.0)
    for seed in range(seeds if noise else 1):
        draw = noise * np.random.default_rng(seed).standard_normal(exact.shape)
        data = np.where(found, exact + draw, 0.0)
        for name, method in METHODS.items():
            error = float(np.abs(method(data, found, noise) - exact)[~found].max())
            worst[name] = max(worst[name], error)
    best = min(worst, key=lambda name: worst[name])
    return {"function": function, "gap": width, "at": place, "noise": noise, **worst, "best": best}


def verdict(place: str, rows: list[dict[str, object]]) -> str:
    """How often the default is no worse than the paper's method, and by how much."""
    default, paper, noise = (
        np.array([row[name] for row in rows], dtype=np.float64) for name in ("smooth", "hardy", "noise")
    )
    worse = int((default > paper + np.maximum(DRAW * paper, noise)).sum())
    best = sum(row["best"] == "smooth" for row in rows)
    ratio = paper / default
    return (
        f"{place}: no worse than the paper in {len(rows) - worse} of {len(rows)} cases, best of all in {best}, "
        f"the paper's error is {np.median(ratio):.1f} times the default's, at least {ratio.min():.2f}"
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--seeds", type=int, default=5, help="draws of the noise")
    arguments.add_argument("--json", type=Path, help="write the rows there too")
    asked = arguments.parse_args()
    print(heading(COLUMNS))
    rows = []
    for function in FUNCTIONS:
        for place in KNOWN:
            for width in WIDTHS:
                for noise in NOISES:
                    rows.append(judge(function, place, width, noise, asked.seeds))
                    print(line(rows[-1], COLUMNS), flush=True)
    print()
    for place in KNOWN:
        print(verdict(place, [row for row in rows if row["at"] == place]))
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
