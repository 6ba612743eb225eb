"""The files of a repair: each is written beside its place and renamed, so none is ever half there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from patchwright.models.errors import ParameterError
from patchwright.pipelines.progress import Report
from patchwright.pipelines.study import Study
from patchwright.repair.result import Verdict


def prepare_folder(folder: Path) -> None:
    """Make the output folder.

    Raises
    ------
    ParameterError : it cannot be made or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".patchwright-probe"
        probe.touch()
        probe.unlink()
    except OSError as error:
        reason = error.strerror or "cannot be written"
        raise ParameterError(f"{folder}: cannot be used as output folder ({reason}); choose another with -o") from None


def write_outputs(study: Study, names: tuple[str, ...], report: Report) -> tuple[str, ...]:
    """Write the geometry files of a repaired study; a refusal has none.

    Returns
    -------
    The names written. A file of an earlier run that this run does not write again is removed, so that a folder never
    holds the results of two runs.
    """
    from patchwright.models.io import write
    from patchwright.repair.layout.layout_file import save_layout

    prepare_folder(study.folder)
    repaired = study.repaired
    if repaired is None:
        raise ParameterError("the recipe writes geometry before any stage made some: put repair before write")
    written = []
    for i, name in enumerate(names):
        path = study.folder / name
        report(f"writing {name}", i / len(names))
        suffix = path.suffix.lower()
        thing: Any = None
        if repaired.verdict is not Verdict.REFUSED:
            if suffix in (".xyz", ".p3d", ".x"):
                thing = repaired.grid
            elif suffix == ".json":
                thing = repaired.network.layout if repaired.network is not None else None
            elif suffix in (".step", ".stp", ".igs", ".iges"):
                thing = repaired.to_assembly() if repaired.faces else None
            else:
                thing = repaired.triangulation
        if thing is None:
            path.unlink(missing_ok=True)
            continue
        if suffix in (".xyz", ".p3d", ".x"):
            # Plot3D holds no names; the report lists the faces in the order of the blocks
            write(path, replace(thing, names=()), iblank=True)
        elif suffix == ".json":
            save_layout(path, thing)
        else:
            write(path, thing)
        written.append(name)
    return tuple(written)
