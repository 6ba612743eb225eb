"""What a Plot3D file is, found by bookkeeping: only a layout that accounts for every byte (or number) is accepted.

A binary file is a Fortran file (each record between two counts of its bytes) or a plain stream, of either byte
order, single or double precision, one block or many, three- or two-dimensional, with IBLANK or without. The form and
meaning of the records are those of the PLOT3D manual (Walatka, Buning, Pierce & Elson, NASA TM-101067, 1990),
"whole" form.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.io.opening import Bytes


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the nodes are.

    Parameters
    ----------
    order : "<" or ">", byte order; "" for text
    marker : bytes of the count before and after each record, 0 for a stream or text
    width : bytes of a coordinate, 1 for text (positions are then counted in numbers)
    sizes : nodes of each block in i, j (and k)
    blanked : whether each block's coordinates are followed by IBLANK
    start : where the first block begins
    """

    order: str
    marker: int
    width: int
    sizes: tuple[tuple[int, ...], ...]
    blanked: bool
    start: int

    @property
    def integer(self) -> int:
        """Bytes of an IBLANK value."""
        return 4 if self.order else 1

    def record(self, block: int) -> int:
        """The length of a block's record without its markers."""
        return prod(self.sizes[block]) * (len(self.sizes[block]) * self.width + self.blanked * self.integer)

    @property
    def length(self) -> int:
        """The length of the whole file."""
        return self.start + sum(self.record(k) + 2 * self.marker for k in range(len(self.sizes)))

    def starts(self) -> Iterator[int]:
        """Where each block's coordinates begin."""
        position = self.start + self.marker
        for k in range(len(self.sizes)):
            yield position
            position += self.record(k) + 2 * self.marker


def text_layouts(numbers: Array, *, alone: bool) -> Iterator[Layout]:
    """The layouts a text file's first numbers allow, whatever its length; `alone`: its first line has one number only.

    A number alone is the number of blocks: the nodes of a single block stand together.
    """
    for many, dimensions in product((True,) if alone else (True, False), (3, 2)):
        count = int(numbers[0]) if many and len(numbers) and 1 <= numbers[0] <= len(numbers) else 0 if many else 1
        table = numbers[int(many) : int(many) + count * dimensions]
        if (
            count
            and len(table) == count * dimensions
            and ((table >= 1) & (table < 2**31) & (table == np.floor(table))).all()
        ):
            sizes = _rows(table.astype(np.int64), dimensions)
            for blanked in (False, True):
                yield Layout("", 0, 1, sizes, blanked, int(many) + len(table))


def binary_layouts(head: Bytes) -> Iterator[Layout]:
    """The layouts a binary file's first bytes allow, whatever its length."""
    for marker, order in product((4, 0, 8), ("<", ">")):
        for many, dimensions in product((True, False), (3, 2)):
            position = 0
            count = 1
            if many:
                record = _record(head, 0, marker, order, 1)
                if record is None or record[0] < 1:
                    continue
                count = int(record[0])
                position = 4 + 2 * marker
            table = _record(head, position, marker, order, count * dimensions)
            if table is None or table.min() < 1:
                continue
            position += 4 * len(table) + 2 * marker
            for width, blanked in product((4, 8), (False, True)):
                yield Layout(order, marker, width, _rows(table, dimensions), blanked, position)


def _rows(table: np.ndarray[tuple[int, ...], np.dtype[np.int64]], dimensions: int) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(int(n) for n in row) for row in table.reshape(-1, dimensions))


def _record(
    head: Bytes, start: int, marker: int, order: str, count: int
) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]] | None:
    """`count` 4-byte integers at `start`, when they are there and the markers around them agree."""
    body = start + marker
    if body + 4 * count + marker > len(head):
        return None
    if marker and not marks(head, body, 4 * count, marker, order):
        return None
    return head[body : body + 4 * count].view(order + "i4").astype(np.int64)


def marks(data: Bytes, body: int, length: int, marker: int, order: str) -> bool:
    """True when both markers of the record data[body:body + length] give its length."""
    end = body + length
    mark = length.to_bytes(8, "big" if order == ">" else "little")
    mark = mark[8 - marker :] if order == ">" else mark[:marker]
    return data[body - marker : body].tobytes() == mark == data[end : end + marker].tobytes()
