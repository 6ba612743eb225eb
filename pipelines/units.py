"""Several inputs in one unit: files that store none are brought to the unit of those that do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from patchwright.models.assembly import Assembly
from patchwright.models.errors import ParameterError
from patchwright.models.structured_grid import StructuredGrid
from patchwright.repair.checks.domain import METRES

Input = Assembly | StructuredGrid


def in_one_unit(
    inputs: Sequence[Input], names: Sequence[str], unit: str | None
) -> tuple[list[Input], str, tuple[str, ...]]:
    """The inputs in one unit, that unit ("unknown" where nothing tells), and notes on what was assumed or scaled.

    Parameters
    ----------
    names : of the files, for messages
    unit : of the inputs that store none; None takes them to be in that of the others, and says so

    Raises
    ------
    ParameterError : an unknown unit; inputs that store different ones; a surface that would have to be scaled.
    """
    if unit is not None and unit not in METRES:
        raise ParameterError(f"the unit {unit!r} is not known; known are {', '.join(METRES)}")
    own = [item.unit if isinstance(item, Assembly) else "unknown" for item in inputs]
    known = [k for k, which in enumerate(own) if which != "unknown"]
    if not known:
        return list(inputs), unit or "unknown", ()
    target = own[known[0]]
    for k in known[1:]:
        if own[k] != target:
            raise ParameterError(
                f"{names[known[0]]} is in {target} and {names[k]} in {own[k]}: export both in one unit"
            )
    out, notes = list(inputs), []
    for k, item in enumerate(inputs):
        if own[k] != "unknown":
            continue
        if unit is None:
            notes.append(f"{names[k]} stores no unit and is taken to be in {target}; --unit says otherwise")
        elif unit != target:
            if target not in METRES:
                raise ParameterError(f"{names[known[0]]} is in {target!r}, to which {unit} cannot be brought")
            factor = METRES[unit] / METRES[target]
            out[k] = _scaled(item, factor, names[k])
            notes.append(f"{names[k]} is taken to be in {unit} and scaled by {factor:.6g} to {target}")
    return out, target, tuple(notes)


def _scaled(item: Input, factor: float, name: str) -> Input:
    if isinstance(item, StructuredGrid):
        return replace(item, blocks=tuple(factor * block for block in item.blocks))
    if any(part.surface is not None for part in item.parts):
        raise ParameterError(f"{name} holds surfaces without a unit: export it with one")
    parts = tuple(
        replace(part, triangulation=replace(part.triangulation, vertices=factor * part.triangulation.vertices))
        for part in item.parts
    )
    return replace(item, parts=parts)
