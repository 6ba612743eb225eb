"""The options of the command line that tell the flow domain, and the `Domain` they make."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from patchwright.repair.domain import Domain

Names = list[str] | None
FarField = Annotated[Names, typer.Option("--farfield", help="Part that is far field (repeatable; '' none).")]
Symmetry = Annotated[Names, typer.Option("--symmetry", help="Symmetry plane: x, y, z or a planar part (repeatable).")]
Fluid = Annotated[str | None, typer.Option("--fluid", help="X,Y,Z: a point in the fluid.")]
Opening = Annotated[Names, typer.Option("--opening", help="X,Y,Z: a planned opening that stays open (repeatable).")]
Gap = Annotated[Names, typer.Option("--gap", help="PART=keep or PART=close: what becomes of its gaps (repeatable).")]
PartTolerance = Annotated[
    Names, typer.Option("--part-tolerance", help="PART=LENGTH: a fit tolerance of its own (repeatable).")
]


def domain_of(
    farfield: Names, symmetry: Names, fluid: str | None, opening: Names, gap: Names, part_tolerance: Names = None
) -> Domain | None:
    """The flow domain, None where nothing was said; an empty far-field name says that there is none.

    Raises
    ------
    ParameterError : an option without meaning.
    """
    if not (farfield or symmetry or fluid or opening or gap or part_tolerance):
        return None
    from patchwright.models.errors import ParameterError
    from patchwright.repair.domain import Domain, place_of

    lengths = {}
    for part, words in _pairs(part_tolerance or (), "--part-tolerance", "LENGTH"):
        try:
            lengths[part] = float(words)
        except ValueError:
            raise ParameterError(f"--part-tolerance needs PART=LENGTH, got {part}={words}") from None
    return Domain(
        far_field=tuple(name for name in farfield if name) if farfield else None,
        symmetry=tuple(symmetry) if symmetry else None,
        fluid=place_of(fluid, "--fluid") if fluid else None,
        openings=tuple(place_of(place, "--opening") for place in opening or ()),
        gaps=dict(_pairs(gap or (), "--gap", "keep or PART=close")),
        tolerances=lengths,
    )


def _pairs(texts: Sequence[str], option: str, value: str) -> list[tuple[str, str]]:
    """Names and values of PART=VALUE; names may hold an equals sign, values not."""
    from patchwright.models.errors import ParameterError

    out = []
    for text in texts:
        part, sign, words = text.rpartition("=")
        if not (part and sign and words):
            raise ParameterError(f"{option} needs PART={value}, got {text!r}")
        out.append((part, words))
    return out
