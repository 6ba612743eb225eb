"""A list of patches in a file a person writes: TOML with four sides, or four corners, for every patch.

tolerance = 0.001                  # model units; left out: 1e-4 of the diagonal
form = "c2"                        # or "c1", the paper's; the other options of `approximate` may stand here too

[[patch]]
name = "roof"
south = { points = [[0, 0, 1], [2, 0, 1.2], [4, 0, 1]], scheme = "c2-cubic", laid = true }   # laid on the geometry
east = { section = { point = [4, 0, 0], normal = [1, 0, 0] }, from = [4, 0, 1], to = [4, 1, 1] }
north = { edge = { from = [0, 1, 1], to = [4, 1, 1] } }                                      # an edge of the CAD model
west = { iso = { part = "skin", u = 0.5 }, from = 0.0, to = 1.0 }                            # an iso-curve of a face

[[patch]]
corners = [[0, 1, 1], [4, 1, 1], [4, 2, 1], [0, 2, 1]]        # four straight sides, laid on the geometry

Sides go round a patch: south, east, north, west, each in either direction. A side may also be where two parts meet:
{ meet = ["wing", "fuselage"], from = [..], to = [..] }.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly, Part
from patchwright.models.errors import CorruptFile, GeometryError, ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.tolerance import Tolerance
from patchwright.repair.patches.patch_ground import PatchGround

if TYPE_CHECKING:
    from patchwright.repair.patches.patch_sides import Side, Sides

TEXTS, LENGTHS = ("form", "twist", "filling", "parameters", "refinement", "hits"), ("offset", "angle")
OPTIONS: dict[str, type] = {**dict.fromkeys(TEXTS, str), **dict.fromkeys(LENGTHS, float), "most": int}
SIDES = ("south", "east", "north", "west")
KINDS: dict[str, set[str]] = {
    "points": {"scheme", "parameters", "laid"}, "section": {"from", "to"}, "edge": set(), "iso": {"from", "to"},
    "meet": {"from", "to"},
}  # fmt: skip
SAME = 0.2  # of a side's chord: sides with common ends nearer than this in the middle are one
CORNER = 0.01  # of the diagonal: sides of a list may miss each other by this much at a corner; both are moved there


@dataclass(frozen=True, slots=True, eq=False)
class PatchSpec:
    """One patch of the list: its name, its sides, and the options of `approximate` that differ from the defaults."""

    name: str
    sides: Sides
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class PatchList:
    """All patches, and the tolerance they share, a length; `note` says where it comes from."""

    patches: tuple[PatchSpec, ...]
    tolerance: float
    note: str = ""


def load_patches(path: Path, model: Assembly, tolerance: float | None = None) -> PatchList:
    """Read a list of patches over a model.

    Parameters
    ----------
    tolerance : replaces the file's own

    Raises
    ------
    CorruptFile : not TOML. ParameterError : a key, part or kind of side that does not exist, no patch.
    GeometryError : sides that do not meet, a curve that is not there; the message names patch and side.
    """
    import tomllib

    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise CorruptFile(f"{path}: no such list of patches") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        raise CorruptFile(f"{path}: cannot be read as TOML: {error}") from None
    _known(path, table, {"tolerance", "patch", *OPTIONS}, "key")
    entries = table.get("patch", [])
    if not isinstance(entries, list) or not entries:
        raise ParameterError(f"{path}: needs at least one [[patch]] with south, east, north and west, or corners")
    wanted = table.get("tolerance") if tolerance is None else tolerance
    if wanted is not None and not (isinstance(wanted, int | float) and np.isfinite(wanted) and wanted > 0.0):
        raise ParameterError(f"{path}: tolerance must be a positive length, got {wanted!r}")
    limits = Tolerance.of(model, fit=wanted)
    shared = _options(path, table)
    source = _Source(model, PatchGround.of(model))
    fit, note = _allowed(limits, source.ground, model)
    patches = []
    for i, entry in enumerate(entries, start=1):
        if not isinstance(entry, dict):
            raise ParameterError(f"{path}: patch {i} must be a table")
        name = str(entry.get("name", f"patch{i}"))
        _known(path, entry, {"name", "corners", *SIDES, *OPTIONS}, f"key of patch {name!r}")
        try:
            sides = source.sides(entry)
        except GeometryError as error:
            raise type(error)(f"{path}: patch {name!r}: {error}") from None
        patches.append(PatchSpec(name, sides, shared | _options(path, entry)))
    return PatchList(tuple(_joined(patches, fit)), fit, note)


def _joined(patches: list[PatchSpec], tolerance: float) -> list[PatchSpec]:
    """The patches with common sides as one curve: sides laid on the geometry from both patches differ between the ends.

    A side takes the curve of an earlier one with the same ends whose middle is no farther off than `SAME` of its chord.
    """
    known: list[Side] = []
    out = []
    for patch in patches:
        own = {}
        for name in SIDES:
            side = getattr(patch.sides, name)
            for other in known:
                same = next((way for way in (other, other.reversed) if _alike(side, way, tolerance)), None)
                if same is not None:
                    own[name] = same
                    break
            else:
                known.append(side)
        out.append(replace(patch, sides=replace(patch.sides, **own)) if own else patch)
    return out


def _alike(side: Side, other: Side, tolerance: float) -> bool:
    """Whether two sides are meant to be one curve."""
    if np.linalg.norm(side.ends - other.ends, axis=1).max() > tolerance:
        return False
    middles = [s.at(np.array([0.5]))[0] for s in (side, other)]
    length = float(np.linalg.norm(side.ends[1] - side.ends[0]))
    return bool(np.linalg.norm(middles[0] - middles[1]) <= SAME * length)


def _allowed(limits: Tolerance, ground: PatchGround, model: Assembly) -> tuple[float, str]:
    """The fit tolerance the data can carry, and a note where it is wider than 1e-4 of the diagonal, or too narrow."""
    if model.is_cad:
        return limits.fit, ""
    from patchwright.repair.layout.faceting import faceting
    from patchwright.repair.mesh_route import WIDEST

    height = faceting(ground.body, limits.angle)
    if height <= limits.fit:
        return limits.fit, ""
    told = f"the facets of the geometry stand up to {height:.3g} below a smooth surface"
    if limits.given:
        return limits.fit, f"{told}, more than the tolerance: a smooth patch may not reach it"
    return min(height, WIDEST * limits.fit), f"{told}: that is the tolerance, as none was given"


def _known(path: Path, table: dict[str, Any], known: set[str], what: str) -> None:
    for key in table:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            raise ParameterError(
                f"{path}: unknown {what} {key!r}; {f'did you mean {near[0]!r}?' if near else 'known: '}"
                + ("" if near else ", ".join(sorted(known)))
            )


def _options(path: Path, table: dict[str, Any]) -> dict[str, Any]:
    out = {}
    for key, kind in OPTIONS.items():
        if key not in table:
            continue
        value = table[key]
        if isinstance(value, bool) or not isinstance(value, (int, float) if kind is float else kind):
            raise ParameterError(f"{path}: {key} must be a {kind.__name__}, got {value!r}")
        out[key] = value
    return out


@dataclass(frozen=True, slots=True, eq=False)
class _Source:
    """Where sides are taken from."""

    model: Assembly
    ground: PatchGround

    def sides(self, entry: dict[str, Any]) -> Sides:
        """The four sides of one entry."""
        from patchwright.repair.patches.patch_sides import Sides, laid, through

        reach = CORNER * self.model.diagonal
        if "corners" in entry:
            if any(k in entry for k in SIDES):
                raise ParameterError("give either corners or four sides, not both")
            corners = _points(entry["corners"], "corners")
            if len(corners) != 4:
                raise ParameterError(f"corners must be four points, got {len(corners)}")
            lines = [through(np.stack([corners[k], corners[(k + 1) % 4]])) for k in range(4)]
            flat = Sides.of(lines[0], lines[1], lines[2], lines[3], reach)
            return laid(flat, self.ground.under(flat))
        missing = [k for k in SIDES if k not in entry]
        if missing:
            raise ParameterError(f"has no {' and no '.join(missing)}; a patch has four sides, or corners")
        made = []
        for name in SIDES:
            try:
                made.append(self.side(entry[name]))
            except GeometryError as error:
                raise type(error)(f"{name}: {error}") from None
        south, east, north, west = (bool(entry[name].get("laid", False)) for name in SIDES)
        firm = (not south, not east, not north, not west)
        drawn = Sides.of(made[0], made[1], made[2], made[3], reach, firm)
        return laid(drawn, self.ground.under(drawn), (south, east, north, west))

    def side(self, told: Any) -> Side:
        """One side from its table."""
        from patchwright.repair.patches import patch_sides, side_paths

        kinds = [k for k in KINDS if isinstance(told, dict) and k in told]
        if len(kinds) != 1:
            raise ParameterError(f"a side is given by one of {', '.join(KINDS)}")
        kind = kinds[0]
        unknown = sorted(set(told) - KINDS[kind] - {kind})
        if unknown:
            raise ParameterError(f"unknown key {', '.join(unknown)}")
        if kind == "points":
            points = _points(told["points"], "points")
            return patch_sides.through(points, told.get("scheme"), told.get("parameters"))
        if kind == "edge":
            edge = told["edge"]
            middle = _place(edge, "through") if isinstance(edge, dict) and "through" in edge else None
            return patch_sides.edge_side(self.model, _place(edge, "from"), _place(edge, "to"), middle)
        if kind == "iso":
            return self._iso(told)
        start, end = _place(told, "from"), _place(told, "to")
        if kind == "section":
            plane = told["section"]
            return side_paths.section_side(
                self.ground.body, _place(plane, "point"), _place(plane, "normal"), start, end
            )
        pair = told["meet"]
        if not isinstance(pair, list) or len(pair) != 2:
            raise ParameterError("meet names two parts")
        a, b = (self._part(str(name)) for name in pair)
        return side_paths.intersection_side(_operand(a), _operand(b), start, end)

    def _iso(self, told: dict[str, Any]) -> Side:
        from patchwright.repair.patches.patch_sides import iso_side

        iso = told["iso"]
        held = [k for k in ("u", "v") if isinstance(iso, dict) and k in iso]
        if len(held) != 1 or "part" not in iso:
            raise ParameterError("an iso-curve names a part and one of u and v")
        surface = self._part(str(iso["part"])).surface
        if surface is None:
            raise ParameterError(f"part {iso['part']!r} has no surface, only triangles")
        nurbs = surface if isinstance(surface, NurbsSurface) else surface.to_nurbs()
        return iso_side(nurbs, held[0], float(iso[held[0]]), told.get("from"), told.get("to"))

    def _part(self, name: str) -> Part:
        for part in self.model.parts:
            if part.name == name:
                return part
        near = difflib.get_close_matches(name, self.model.names, n=3) or list(self.model.names[:3])
        raise ParameterError(f"there is no part {name!r}; there are {', '.join(near)}, ...")


def _operand(part: Part) -> Any:
    return part if part.surface is not None else part.triangulation


def _points(value: Any, name: str) -> Array:
    try:
        points = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1:] != (3,) or not np.isfinite(points).all():
        raise ParameterError(f"{name} must be a list of points [x, y, z]")
    return points


def _place(table: Any, key: str) -> Array:
    value = table.get(key) if isinstance(table, dict) else None
    if value is None:
        raise ParameterError(f"needs {key} = [x, y, z]")
    return np.asarray(_points([value], key)[0])
