"""`Plan`: what a repair would do, item by item, to be reviewed, edited, and replayed on a revised model.

An item is known by its fingerprint (kind, place, size, parts), so a plan survives re-meshing and small moves. Changes
that nothing else stands on can be rejected: what they would have mended stays as it is. Replayed on another revision,
items that are no longer there and changes the plan does not know are told, never passed over.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from patchwright.models.errors import CorruptFile
from patchwright.repair.decisions import CARRIED, OPTIONAL
from patchwright.repair.fingerprint import Fingerprint, fingerprint, labels, matched
from patchwright.repair.mender.mended import LEFT_OUT
from patchwright.repair.result import LedgerEntry, Problem, Rung

VERSION = 1
_NOWHERE = (0.0, 0.0, 0.0)
_SUMS = (
    "pieces of triangles cut where bodies cross",
    "triangles invented to bridge gaps",
    "patches fitted",
    "patches cross",
    CARRIED,
)
"""ledger entries that sum up what others did, or that follow for every model"""


@dataclass(frozen=True, slots=True)
class PlanItem:
    """One change.

    Parameters
    ----------
    id : "kind-hash", the same for the same change of the same model in whatever order
    kind : what is done, in the ledger's words
    rung : its step on the ladder
    where : (x, y, z) middle of the place; None for a change without one
    size : extent of the place, model length unit
    parts : names of the parts concerned, () when the change has none of its own
    count : triangles, edges, vertices or faces concerned
    area : surface added or removed, square model units
    reason : one sentence
    optional : whether it may be rejected
    accepted : False when the reviewer rejects it
    """

    id: str
    kind: str
    rung: str
    where: tuple[float, float, float] | None
    size: float
    parts: tuple[str, ...]
    count: int
    area: float
    reason: str
    optional: bool
    accepted: bool = True

    @property
    def fingerprint(self) -> Fingerprint:
        """What it is known by in a revised model."""
        return fingerprint(self.kind, self.where or _NOWHERE, self.size, self.parts)


@dataclass(frozen=True, slots=True)
class Plan:
    """The changes of one repair; `diagonal` is the body's, `problems` are why it would be refused."""

    source: str
    diagonal: float
    items: tuple[PlanItem, ...]
    problems: tuple[Problem, ...] = ()
    domain: tuple[str, ...] = ()

    @property
    def rejected(self) -> tuple[PlanItem, ...]:
        """The items the reviewer rejects."""
        return tuple(item for item in self.items if not item.accepted)

    def to_json(self) -> dict[str, Any]:
        """Plain values, fit for `json.dumps`; set "accepted" of an item to false to reject it."""
        return {
            "patchwright_plan": VERSION,
            "source": self.source,
            "diagonal": self.diagonal,
            "domain": list(self.domain),
            "items": [
                {
                    "id": item.id,
                    "accepted": item.accepted,
                    "optional": item.optional,
                    "kind": item.kind,
                    "rung": item.rung,
                    "where": None if item.where is None else list(item.where),
                    "size": item.size,
                    "parts": list(item.parts),
                    "count": item.count,
                    "area": item.area,
                    "reason": item.reason,
                }
                for item in self.items
            ],
            "problems": [
                {"kind": p.kind, "where": list(p.where), "size": p.size, "message": p.message} for p in self.problems
            ],
        }

    @classmethod
    def from_json(cls, table: Any, source: str = "the plan") -> Plan:
        """Read back what `to_json` gave, edited or not.

        Raises
        ------
        CorruptFile : not a plan, or an item rejected that cannot be; the text names it.
        """
        try:
            if table["patchwright_plan"] != VERSION:
                raise ValueError(f"its version is {table['patchwright_plan']!r}, known is {VERSION}")
            items = tuple(_item(entry) for entry in table["items"])
            plan = cls(str(table["source"]), float(table["diagonal"]), items)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise CorruptFile(f"{source}: is no plan of patchwright ({error}); make one with --dry-run") from None
        for item in plan.rejected:
            if not item.optional:
                raise CorruptFile(
                    f"{source}: item {item.id} ({item.kind}) cannot be rejected, later steps stand on it; only items "
                    f'with "optional": true can'
                )
        return plan


def plan_of(
    source: str,
    ledger: Sequence[LedgerEntry],
    diagonal: float,
    problems: Sequence[Problem] = (),
    domain: Sequence[str] = (),
) -> Plan:
    """The plan behind a ledger: every entry that changes something; what is kept is no item."""
    changes = [e for e in ledger if _is_change(e)]
    prints = [fingerprint(e.what, e.where or _NOWHERE, e.size, e.parts) for e in changes]
    items = tuple(
        PlanItem(
            name, e.what, e.rung.value, e.where, float(e.size), tuple(e.parts), int(e.count), float(e.area), e.reason,
            e.what in OPTIONAL,
        )
        for name, e in zip(labels(prints, diagonal), changes, strict=True)
    )  # fmt: skip
    return Plan(source, float(diagonal), items, tuple(problems), tuple(domain))


def compared(
    plan: Plan, ledger: Sequence[LedgerEntry], diagonal: float
) -> tuple[tuple[PlanItem, ...], tuple[LedgerEntry, ...]]:
    """(missing, unplanned): items of a plan that a run did not meet, and changes it made beside the plan.

    A rejected item is met where its change was left out.
    """
    now = [e for e in ledger if _is_change(e) or e.what.endswith(LEFT_OUT)]
    prints = [fingerprint(e.what.removesuffix(LEFT_OUT), e.where or _NOWHERE, e.size, e.parts) for e in now]
    pairs = matched([item.fingerprint for item in plan.items], prints, diagonal)
    met = set(pairs.values())
    missing = tuple(item for i, item in enumerate(plan.items) if i not in met)
    unplanned = tuple(e for j, e in enumerate(now) if j not in pairs and _is_change(e))
    return missing, unplanned


def with_rejections(plan: Plan, reviewed: Plan) -> Plan:
    """A fresh plan with the rejections of a reviewed one, found by their fingerprints."""
    pairs = matched(
        [item.fingerprint for item in reviewed.items], [item.fingerprint for item in plan.items], plan.diagonal
    )
    return replace(
        plan,
        items=tuple(
            replace(item, accepted=reviewed.items[pairs[i]].accepted or not item.optional) if i in pairs else item
            for i, item in enumerate(plan.items)
        ),
    )


def _is_change(entry: LedgerEntry) -> bool:
    """Whether a ledger entry is a change of its own: not what was kept, and not a sum over others."""
    kept = entry.rung is Rung.KEEP and entry.what != "orient"
    return not kept and entry.rung is not Rung.REFUSE and entry.what not in _SUMS


def _item(entry: Mapping[str, Any]) -> PlanItem:
    where = entry["where"]
    if not isinstance(entry["accepted"], bool):
        raise ValueError(f'"accepted" of {entry["id"]} must be true or false, not {entry["accepted"]!r}')
    return PlanItem(
        str(entry["id"]),
        str(entry["kind"]),
        str(entry["rung"]),
        None if where is None else (float(where[0]), float(where[1]), float(where[2])),
        float(entry["size"]),
        tuple(str(part) for part in entry["parts"]),
        int(entry["count"]),
        float(entry["area"]),
        str(entry["reason"]),
        bool(entry["optional"]),
        entry["accepted"],
    )
