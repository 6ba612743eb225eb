"""Numbers out of text, and numbers to text, fast and exact: what is written reads back as the same float64."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import CorruptFile
from patchwright.models.io.opening import LARGEST, Bytes, line_of, token_at

NO_COMMENT = -1


def read_numbers(
    path: Path, data: Bytes, start: int = 0, *, most: int | None = None, comment: str = ""
) -> tuple[Array, int]:
    """The blank-separated numbers of data[start:], at most `most` of them, and the position after the last.

    `comment` is the character from which a line is skipped. Fortran's repeats ("3*0.5") and D exponents count.

    Raises
    ------
    CorruptFile : a word that is not a number; the text names its line.
    """
    from patchwright.models.io._number_kernel import BAD, numbers

    room = _most_numbers(path, data, start) if most is None else most
    out = np.empty(room, dtype=np.float64)
    mark = ord(comment) if comment else NO_COMMENT
    count, position, status, slow = numbers(data, start, len(data), mark, out)
    if status == BAD:
        raise CorruptFile(
            f"{path}: line {line_of(data, position)} has {token_at(data, position)!r} where a number was expected; "
            "correct the line or export the file again"
        )
    settle(data, slow, out)
    return out[:count], position


def _most_numbers(path: Path, data: Bytes, start: int) -> int:
    """How many numbers data[start:] can hold: one for every two bytes, and what the repeats stand for."""
    room = (len(data) - start + 1) // 2
    text = data[start:].tobytes()
    if b"*" in text:
        room += sum(int(times) for times in re.findall(rb"(\d{1,18})\*", text))
        if room > LARGEST // 8:
            raise CorruptFile(
                f"{path}: its repeat counts stand for {room} numbers, more than {LARGEST >> 30} GiB; split the file"
            )
    return room


def settle(data: Bytes, slow: IntArray, out: Array) -> None:
    """Reads the few numbers the compiled loop could not round (more than 19 digits, next to a tie) into flat `out`."""
    for begin, stop, target in slow.tolist():
        word = data[begin:stop].tobytes().decode("ascii")
        out[target] = float(word.translate(str.maketrans("dD", "ee")))


def number_lines(values: npt.NDArray[np.float64], prefix: str = "") -> bytes:
    """One line per row of (n, k) `values`, the shortest decimals that read back the same, blank-separated."""
    words = [repr(x) for x in values.ravel().tolist()]
    columns = [words[k :: values.shape[1]] for k in range(values.shape[1])]
    return "".join([f"{prefix}{' '.join(row)}\n" for row in zip(*columns, strict=True)]).encode()


def integer_lines(values: npt.NDArray[np.int64], prefix: str = "") -> bytes:
    """One line per row of (n, k) integers, blank-separated."""
    line = prefix + " ".join(["%d"] * values.shape[1]) + "\n"
    return ((line * len(values)) % tuple(values.ravel().tolist())).encode()
