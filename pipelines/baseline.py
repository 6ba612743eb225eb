"""Baselines: the defects a project lives with, so that a check fails on new ones only.

A baseline is a JSON file: for every checked file, named relative to the baseline's own folder, the fingerprints of its
defects. A defect is known when the same kind was there, of about the same size, at about the same place; one that grew
by half is new.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from patchwright.models.errors import CorruptFile
from patchwright.models.io.atomic import replacing
from patchwright.repair.diagnosis import Defect, Diagnosis
from patchwright.repair.fingerprint import Fingerprint, fingerprint, matched

VERSION = 1


@dataclass(frozen=True, slots=True, eq=False)
class Baseline:
    """The known defects of some files; `folder` is what their names are relative to."""

    folder: Path
    files: Mapping[str, tuple[Fingerprint, ...]]

    def compared(self, file: Path, diagnosis: Diagnosis) -> tuple[tuple[Defect, ...], tuple[Defect, ...], int]:
        """(new, known, gone): the defects the baseline does not list, those it lists, and how many it lists in vain."""
        old = self.files.get(_key(file, self.folder), ())
        now = [defect.fingerprint for defect in diagnosis.defects]
        pairs = matched(old, now, float(diagnosis.summary.get("diagonal", 0.0)))
        fresh = tuple(d for i, d in enumerate(diagnosis.defects) if i not in pairs)
        known = tuple(d for i, d in enumerate(diagnosis.defects) if i in pairs)
        return fresh, known, len(old) - len(pairs)


def load_baseline(path: Path) -> Baseline:
    """Read a baseline.

    Raises
    ------
    CorruptFile : no such file, or not a baseline; the text says how to write one.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        if table["patchwright_baseline"] != VERSION:
            raise ValueError(f"its version is {table['patchwright_baseline']!r}, known is {VERSION}")
        files = {
            name: tuple(fingerprint(d["kind"], d["where"], d["size"], d["parts"]) for d in some)
            for name, some in table["files"].items()
        }
    except FileNotFoundError:
        raise CorruptFile(f"{path}: no such baseline; make it with --write-baseline {path}") from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise CorruptFile(f"{path}: is no baseline of patchwright ({error}); write it with --write-baseline") from None
    return Baseline(path.resolve().parent, files)


def write_baseline(path: Path, checked: Sequence[tuple[Path, Diagnosis]]) -> None:
    """Write the defects of some files as a baseline.

    Raises
    ------
    ParameterError : the file cannot be written.
    """
    folder = path.resolve().parent
    files: dict[str, list[dict[str, Any]]] = {
        _key(file, folder): [
            {
                "id": d.id,
                "kind": d.kind,
                "severity": d.severity,
                "where": d.where.tolist(),
                "size": d.size,
                "parts": list(d.parts),
                "message": d.message,
            }
            for d in diagnosis.defects
        ]
        for file, diagnosis in checked
    }
    text = json.dumps({"patchwright_baseline": VERSION, "files": files}, indent=1, allow_nan=False)
    with replacing(path) as beside:
        beside.write_text(text + "\n", encoding="utf-8")


def _key(file: Path, folder: Path) -> str:
    """The file's name relative to the baseline's folder, with forward slashes."""
    try:
        return Path(os.path.relpath(file.resolve(), folder)).as_posix()
    except ValueError:  # another drive
        return file.resolve().as_posix()
