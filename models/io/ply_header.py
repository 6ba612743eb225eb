"""The header of a PLY file: elements, their properties and where the data begins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.models.errors import CorruptFile

TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True, slots=True)
class Property:
    """One property: numpy's code of its items, and of its count when it is a list ("" when not)."""

    name: str
    item: str
    count: str = ""


@dataclass(frozen=True, slots=True)
class Element:
    """One element: how many rows of which properties."""

    name: str
    rows: int
    properties: tuple[Property, ...]

    @property
    def layout(self) -> IntArray:
        """(p, 5) per property: whether a list, bytes of its count, count signed, bytes of an item, item signed."""
        table = [
            (bool(p.count), int((p.count or "i0")[1]), p.count[:1] == "i", int(p.item[1]), p.item[0] == "i")
            for p in self.properties
        ]
        return np.array(table, dtype=np.int64).reshape(-1, 5)

    def find(self, *names: str) -> int:
        """The number of the first property with one of these names, −1 when there is none."""
        return next((i for i, p in enumerate(self.properties) if p.name in names), -1)


@dataclass(frozen=True, slots=True)
class Header:
    """`order` is "" for text, "<" or ">" for binary data of that byte order; `length` is the header's, in bytes."""

    order: str
    elements: tuple[Element, ...]
    length: int


def parse_header(path: Path, head: bytes) -> Header:
    """The header at the beginning of a PLY file.

    Raises
    ------
    CorruptFile : not PLY, or a header line that is not understood; the text names the line.
    """
    if head[:3] != b"ply" or head[3:4] not in (b"\n", b"\r", b" "):
        raise CorruptFile(
            f"{path}: begins with {head[:8].decode('ascii', 'replace')!r} instead of 'ply'; check its suffix"
        )
    end = head.find(b"end_header")
    if end < 0:
        raise CorruptFile(f"{path}: its header has no 'end_header' in the first {len(head)} bytes; export it again")
    length = end + len(b"end_header")
    while head[length : length + 1] in (b" ", b"\t"):
        length += 1
    length += 2 if head[length : length + 2] == b"\r\n" else 1
    order: str | None = None
    elements: list[Element] = []
    properties: list[list[Property]] = []
    for number, line in enumerate(head[:end].decode("latin-1").splitlines()[1:], start=2):
        match line.split():
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", name, "1.0"] if name in FORMATS:
                order = FORMATS[name]
            case ["element", name, rows] if rows.isascii() and rows.isdigit() and len(rows) < 16:
                properties.append([])
                elements.append(Element(name, int(rows), ()))
            case ["property", "list", count, item, name] if (
                properties and TYPES.get(count, "f")[0] != "f" and item in TYPES
            ):
                properties[-1].append(Property(name, TYPES[item], TYPES[count]))
            case ["property", item, name] if properties and item in TYPES:
                properties[-1].append(Property(name, TYPES[item]))
            case _:
                raise CorruptFile(
                    f"{path}: line {number} of its header is not understood: {line[:60]!r}; export it again"
                )
    if order is None:
        raise CorruptFile(f"{path}: its header does not say its format; export it again")
    whole = (Element(e.name, e.rows, tuple(p)) for e, p in zip(elements, properties, strict=True))
    return Header(order, tuple(whole), length)
