"""`patchwright reparam`: CAD faces in, the same faces with chord-length parameters out, with a report and a picture."""

from __future__ import annotations

import difflib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models.assembly import Assembly, Part
from patchwright.models.errors import GeometryError, ParameterError, UnsupportedFormat
from patchwright.models.io import read, write
from patchwright.models.io.atomic import writing
from patchwright.models.io.registry import format_of
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.pipelines.progress import Terminal
from patchwright.reparam import Region, Reparametrized, face_region, parametrisation_defect, reparametrize
from patchwright.reparam.charting import check_region
from patchwright.reparam.neighbours import components
from patchwright.reparam.reparametrize import GOOD


@dataclass(frozen=True, slots=True, eq=False)
class FaceReport:
    """One face: what was done with it, or why it was kept.

    `refused` says that it was asked for by name, or tried, and could not be done.
    """

    number: int
    name: str
    defect: float | None
    region: Region | None = None
    result: Reparametrized | None = None
    kept: str = ""
    refused: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class ReparamRun:
    """Every face, the tolerance in the file's unit, and the files written."""

    source: str
    unit: str
    tolerance: float
    faces: tuple[FaceReport, ...]
    files: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether no face that was asked for had to be left."""
        return not any(f.refused for f in self.faces)


def run_reparam(
    source: Path, output: Path, *, tolerance: float | None, names: Sequence[str], terminal: Terminal
) -> ReparamRun:
    """Read, reparametrize all faces or those named, and write the model, the report and the picture.

    Faces that share sides are done together. A face that is good already, has not four sides or cannot be kept within
    the tolerance stays as it came.

    Raises
    ------
    ParameterError : a name no face has, a tolerance that is not positive, a file without surfaces.
    UnsupportedFormat : an output that cannot hold surfaces.
    """
    if "surfaces" not in format_of(output).holds:
        raise UnsupportedFormat(f"{output}: {format_of(output).name} cannot hold surfaces; write .step or .igs")
    if tolerance is not None and not (np.isfinite(tolerance) and tolerance > 0.0):
        raise ParameterError(
            f"the tolerance must be a positive length, got {tolerance}; leave it out for 1e-4 of the size"
        )
    with terminal.stage("read") as report:
        report(f"reading {source.name}", 0.0)
        assembly = read(source)
    if not assembly.is_cad:
        raise ParameterError(f"{source}: holds triangles, no surfaces; reparam takes STEP or IGES")
    wanted = _wanted(assembly, names, source)
    allowed = Tolerance.of(assembly, fit=tolerance).fit
    with terminal.stage("reparam") as report:
        faces = _faces(assembly, wanted, bool(names), allowed, report)
    run = ReparamRun(str(source), assembly.unit, allowed, faces)
    with terminal.stage("write") as report:
        report(f"writing {output.name}", 0.0)
        output.parent.mkdir(parents=True, exist_ok=True)
        write(output, _rebuilt(assembly, faces))
        listing = output.with_name(f"{output.stem}-report.json")
        with writing(listing) as out:
            out.write(json.dumps(reparam_json(run), indent=1, allow_nan=False).encode())
        report("drawing", 0.7)
        from patchwright.pipelines.isolines import draw_isolines

        picture = output.with_suffix(".png")
        sentence = draw_isolines(picture, assembly, faces, source.name)
    files = (output.name, listing.name) + ((picture.name,) if sentence is None else ())
    return replace(run, files=files, notes=() if sentence is None else (sentence,))


def _wanted(assembly: Assembly, names: Sequence[str], source: Path) -> set[int]:
    """The numbers of the faces asked for, all when no name is given."""
    if not names:
        return set(range(len(assembly.parts)))
    known = assembly.names
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=3) or list(known[:3])
            raise ParameterError(f"{source}: has no face named {name!r}; there are {', '.join(near)}, ...")
    return {i for i, name in enumerate(known) if name in names}


def _faces(assembly: Assembly, wanted: set[int], named: bool, tolerance: float, report: Any) -> tuple[FaceReport, ...]:
    found: dict[int, FaceReport] = {}
    for i, part in enumerate(assembly.parts):
        report("looking at the faces", 0.1 * i / len(assembly.parts))
        found[i] = _looked_at(i, part, i in wanted, named)
    open_faces = [f for f in found.values() if f.region is not None]
    groups = components([f.region for f in open_faces if f.region is not None], tolerance)
    done = 0
    for group in groups:
        members = [open_faces[k] for k in group]
        report(f"{len(open_faces)} faces, {len(groups)} groups", 0.1 + 0.9 * done / max(len(open_faces), 1))
        done += len(members)
        for face, made in zip(members, _group(members, tolerance), strict=True):
            found[face.number] = made
    return tuple(found[i] for i in range(len(assembly.parts)))


def _looked_at(number: int, part: Part, wanted: bool, named: bool) -> FaceReport:
    """The face with its region, or with the reason why it stays."""
    if not wanted:
        return FaceReport(number, part.name, None, kept="not asked for")
    try:
        region = face_region(part)
        defect = parametrisation_defect(region.surface, region.box)
        own = part.surface
        if region.whole and own is not None and own is not region.surface:
            defect = parametrisation_defect(own)  # an analytic surface is judged by its own parameters
        if region.whole and defect <= GOOD:
            return FaceReport(number, part.name, defect, kept=f"good as it is: its defect is at most {GOOD:g}")
        check_region(region)
    except GeometryError as error:
        return FaceReport(number, part.name, None, kept=str(error).removeprefix(f"{part.name}: "), refused=named)
    return FaceReport(number, part.name, defect, region)


def _group(members: Sequence[FaceReport], tolerance: float) -> list[FaceReport]:
    """Faces that share sides, done together."""
    regions = [f.region for f in members if f.region is not None]
    try:
        results = reparametrize(regions, tolerance)
    except GeometryError as error:
        return [replace(f, region=None, kept=str(error), refused=True) for f in members]
    out = []
    for face, result in zip(members, results, strict=True):
        if result.converged:
            out.append(replace(face, result=result, defect=result.defect_before))
            continue
        why = "the new surface would fold" if result.least_sine <= 0.0 else f"deviation {result.deviation:.3g} at best"
        out.append(replace(face, region=None, kept=f"not within the tolerance: {why}", refused=True))
    return out


def _rebuilt(assembly: Assembly, faces: Sequence[FaceReport]) -> Assembly:
    """The assembly with the new surfaces in place, outward as the old ones; kept faces keep their native form."""
    if not any(f.result for f in faces):
        return assembly
    nothing = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    parts = []
    for i, (part, face) in enumerate(zip(assembly.parts, faces, strict=True)):
        if face.result is None:
            parts.append(part)
            continue
        inward = assembly.topology is not None and assembly.topology.flipped[i]
        surface = face.result.surface.transposed() if inward else face.result.surface
        parts.append(Part(part.name, nothing, surface, body=part.body))
    return replace(assembly, parts=tuple(parts), topology=None, native=None)


def reparam_json(run: ReparamRun) -> dict[str, Any]:
    """The report as plain values."""
    faces = []
    for face in run.faces:
        entry: dict[str, Any] = {"face": face.number + 1, "name": face.name, "defect before": face.defect}
        if face.result is None:
            entry |= {"done": False, "reason": face.kept, "refused": face.refused}
        else:
            r = face.result
            entry |= {
                "done": True,
                "defect after": r.defect_after,
                "deviation": r.deviation,
                "control points before": list(r.control_points_before),
                "control points after": list(r.control_points_after),
                "least sine between tangents": r.least_sine,
                "notes": list(r.notes),
            }
        faces.append(entry)
    return {
        "source": run.source,
        "unit": run.unit,
        "tolerance": run.tolerance,
        "done": sum(f.result is not None for f in run.faces),
        "complete": run.complete,
        "faces": faces,
    }


def reparam_lines(run: ReparamRun) -> list[str]:
    """The report as text."""
    done = [f for f in run.faces if f.result is not None]
    lines = [
        f"{run.source}: {len(done)} of {len(run.faces)} faces reparametrized within {run.tolerance:.4g} {run.unit}"
    ]
    if done:
        lines.append(f"  {'face':<28}{'defect':>9}{'after':>9}{'deviation':>12}{'points':>10}{'after':>10}")
    for face in done:
        r = face.result
        if r is not None:
            before, after = (f"{a}x{b}" for a, b in (r.control_points_before, r.control_points_after))
            lines.append(
                f"  {_named(face):<28}{r.defect_before:>9.3g}{r.defect_after:>9.2g}{r.deviation:>12.3g}"
                f"{before:>10}{after:>10}"
            )
            lines += [f"    {note}" for note in r.notes]
    reasons: dict[str, list[FaceReport]] = {}
    for face in run.faces:
        if face.result is None:
            reasons.setdefault(face.kept, []).append(face)
    for reason, faces in reasons.items():
        which = ", ".join(_named(f) for f in faces[:4]) + (", ..." if len(faces) > 4 else "")
        lines.append(f"  kept: {len(faces)} ({which}): {reason}")
    if run.files:
        lines.append("written: " + ", ".join(run.files))
    return lines + list(run.notes)


def _named(face: FaceReport) -> str:
    return face.name or f"face {face.number + 1}"
