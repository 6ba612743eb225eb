"""`patchwright check`: many files examined, held against a baseline, and turned into pass or fail."""

from __future__ import annotations

import glob
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from patchwright.models.errors import EngineError, GeometryError, ParameterError
from patchwright.models.io.registry import FORMATS
from patchwright.pipelines.baseline import Baseline, load_baseline, write_baseline
from patchwright.pipelines.progress import Terminal
from patchwright.repair.diagnosis import KINDS, Defect, Diagnosis
from patchwright.repair.domain import Domain

LEVELS = {"error": ("error",), "warning": ("error", "warning"), "never": ()}


@dataclass(frozen=True, slots=True)
class FailOn:
    """Which defects make a check fail: all of some severities, or of some kinds whatever their severity."""

    severities: tuple[str, ...]
    kinds: tuple[str, ...] = ()

    @classmethod
    def of(cls, text: str) -> FailOn:
        """From "error", "warning", "never" or kinds joined by commas; a level may stand among the kinds.

        Raises
        ------
        ParameterError : a word that is none of them.
        """
        words = [word.strip() for word in text.split(",") if word.strip()]
        unknown = [word for word in words if word not in LEVELS and word not in KINDS]
        if unknown or not words:
            known = ", ".join((*LEVELS, *KINDS))
            raise ParameterError(f"--fail-on knows no {', '.join(unknown) or 'empty list'}; known are {known}")
        severities = tuple(dict.fromkeys(s for word in words for s in LEVELS.get(word, ())))
        return cls(severities, tuple(word for word in words if word in KINDS))

    def chosen(self, defects: Sequence[Defect]) -> tuple[Defect, ...]:
        """Those of the defects that count."""
        return tuple(d for d in defects if d.severity in self.severities or d.kind in self.kinds)


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """One file's outcome: its diagnosis or the sentence why there is none, and the defects that make it fail.

    `known` are defects the baseline lists, `gone` how many it lists that are no longer there.
    """

    file: Path
    diagnosis: Diagnosis | None
    failing: tuple[Defect, ...] = ()
    known: tuple[Defect, ...] = ()
    gone: int = 0
    error: str = ""
    internal: bool = False


def run_check(
    patterns: Sequence[str],
    *,
    fail_on: FailOn,
    baseline: Path | None = None,
    write: Path | None = None,
    domain: Domain | None = None,
    terminal: Terminal | None = None,
) -> tuple[Checked, ...]:
    """Examine every file the patterns name; a file that cannot be read does not keep the others from being examined.

    Parameters
    ----------
    patterns : files, folders (searched through) and globs ("**" goes through folders)
    baseline : known defects, that do not count
    write : where to write all defects found as a new baseline; nothing is written when a file could not be read
    domain : what the user says about the flow domain, for all files

    Raises
    ------
    ParameterError : a pattern without a file, a baseline that cannot be written. CorruptFile : a baseline that is none.
    """
    known = None if baseline is None else load_baseline(baseline)
    shown = terminal or Terminal(quiet=True)
    results = tuple(_examined(file, fail_on, known, domain, shown) for file in files_of(patterns))
    if write is not None:
        bad = [r for r in results if r.diagnosis is None]
        if bad:
            raise ParameterError(f"{write}: no baseline is written, because {bad[0].error}")
        write_baseline(write, [(r.file, r.diagnosis) for r in results if r.diagnosis is not None])
        results = tuple(replace(r, failing=()) for r in results)
    return results


def files_of(patterns: Sequence[str]) -> list[Path]:
    """The files that patterns name, each once, in the order of the patterns, sorted within each.

    Raises
    ------
    ParameterError : a folder or glob that holds no file of a known format.
    """
    readable = tuple(suffix for entry in FORMATS if entry.reads for suffix in entry.suffixes)
    found: dict[Path, None] = {}
    for pattern in patterns:
        place = Path(pattern)
        if place.is_dir():
            some = sorted(p for p in place.rglob("*") if p.is_file() and p.name.lower().endswith(readable))
            what = "the folder holds no file of a known format"
        elif glob.has_magic(pattern) and not place.exists():
            names = sorted(glob.glob(pattern, recursive=True))
            some = [p for p in map(Path, names) if p.is_file() and p.name.lower().endswith(readable)]
            what = "no file of a known format matches"
        else:
            some, what = [place], ""
        if not some:
            raise ParameterError(f"{pattern}: {what}; known are {' '.join(sorted(readable))}")
        found.update(dict.fromkeys(some))
    return list(found)


def _examined(
    file: Path, fail_on: FailOn, baseline: Baseline | None, domain: Domain | None, terminal: Terminal
) -> Checked:
    from patchwright.models.io import read
    from patchwright.repair import diagnose

    try:
        with terminal.stage(f"check {file.name}") as report:
            report("reading", 0.0)
            assembly = read(file)
            diagnosis = diagnose(
                assembly, domain=domain, progress=lambda name, share: report("diagnosing", 0.3 + 0.7 * share)
            )
    except GeometryError as error:
        text = str(error) if file.name in str(error) else f"{file}: {error}"
        return Checked(file, None, error=text, internal=isinstance(error, EngineError))
    if baseline is None:
        return Checked(file, diagnosis, fail_on.chosen(diagnosis.defects))
    fresh, known, gone = baseline.compared(file, diagnosis)
    return Checked(file, diagnosis, fail_on.chosen(fresh), known, gone)


def checked_json(result: Checked) -> dict[str, Any]:
    """One file's outcome as plain values."""
    if result.diagnosis is None:
        return {"file": str(result.file), "error": result.error, "failed": True}
    return {
        "file": str(result.file),
        "failed": bool(result.failing),
        "failing": [d.id for d in result.failing],
        "known": [d.id for d in result.known],
        "gone": result.gone,
        **result.diagnosis.to_json(),
    }
