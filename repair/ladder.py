"""`repair`: the way in. Chooses the route by what the input is and climbs the least-change ladder."""

from __future__ import annotations

from typing import Any, Literal

from patchwright.models.assembly import Assembly
from patchwright.models.errors import ParameterError
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.diagnosis import Diagnosis
from patchwright.repair.result import Progress, Repaired

SCOPES = ("least", "all")
OPENINGS = ("keep", "close")


def repair(
    assembly: Assembly | Triangulation,
    *,
    scope: str = "least",
    layout: Any = "auto",
    openings: Literal["keep", "close"] = "keep",
    tolerance: Tolerance | float | None = None,
    domain: None = None,
    diagnosis: Diagnosis | None = None,
    progress: Progress | None = None,
) -> Repaired:
    """Mend a model with the least change.

    Parameters
    ----------
    assembly : what `read` returned, or a triangulation
    scope : "least" keeps what is good, "all" resurfaces everything
    layout : "auto", a `QuadLayout`, or a list of patches, each given by four boundary curves or four corner points
    openings : "keep" reports planned openings and leaves them, "close" caps them
    tolerance : a `Tolerance`, or the fit tolerance as a length; default 1e-4 of the diagonal
    domain : reserved for the flow domain; only None is accepted for now
    diagnosis : of the same assembly, when it has been made already
    progress : called with a label and a share in [0, 1]

    Returns
    -------
    Repaired; a model that cannot be repaired comes back with verdict "refused" and the coordinates of the reasons.

    Raises
    ------
    ParameterError : an option without meaning, an empty assembly.
    """
    if scope not in SCOPES:
        raise ParameterError(f"scope must be one of {', '.join(SCOPES)}, got {scope!r}")
    if openings not in OPENINGS:
        raise ParameterError(f"openings must be one of {', '.join(OPENINGS)}, got {openings!r}")
    if domain is not None:
        raise ParameterError("domain must be None in this version")
    model = Assembly.of(assembly) if isinstance(assembly, Triangulation) else assembly
    if not any(len(part.triangulation) for part in model.parts):
        raise ParameterError(
            f"{model.source or 'the assembly'} holds no triangles and no faces: there is nothing to repair"
        )
    limits = tolerance if isinstance(tolerance, Tolerance) else Tolerance.of(model, fit=tolerance)
    say = progress or (lambda label, share: None)
    if diagnosis is None:
        from patchwright.repair.diagnosing import diagnose

        say("diagnosing", 0.0)
        diagnosis = diagnose(model, tolerance=limits)
    if model.is_cad and scope == "least":
        from patchwright.repair.cad_route import repair_cad

        return repair_cad(model, limits, openings=openings, diagnosis=diagnosis, progress=say)
    from patchwright.repair.given_layout import layout_of
    from patchwright.repair.mesh_route import repair_mesh

    given = layout if isinstance(layout, str) else layout_of(layout, limits)
    return repair_mesh(model, limits, scope=scope, layout=given, openings=openings, clean=diagnosis.clean, progress=say)
