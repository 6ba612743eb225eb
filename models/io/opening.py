"""Opening a file to read: every way this can fail said in one sentence, gzip seen by content, memory bounded."""

from __future__ import annotations

import gzip
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from typing import IO

import numpy as np
import numpy.typing as npt

from patchwright.models.errors import CorruptFile

Bytes = npt.NDArray[np.uint8]

HEAD = 1 << 16  # bytes looked at before anything else is read
CHUNK = 1 << 22  # bytes unpacked at a time
LARGEST = 1 << 32  # bytes: about 80 million triangles of binary STL; a reader needs some four times as much memory


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """An open file whose first bytes are known.

    Parameters
    ----------
    path : the file's path as it was given
    head : the first bytes, unpacked, at most `HEAD`
    size : the file's size in bytes, None when it is packed
    """

    path: Path
    head: bytes
    size: int | None
    _stream: IO[bytes]

    @property
    def is_text(self) -> bool:
        """True when the head holds no byte that text cannot hold (bytes above 127 are taken for UTF-8 or Latin
        names)."""
        return not self.head.translate(None, delete=TEXT_BYTES)

    def read(self, length: int | None = None) -> Bytes:
        """(n,) read-only, the first `length` bytes unpacked, or the whole file when None; shorter when
        the file is.

        Raises
        ------
        CorruptFile : the file holds more than `LARGEST` bytes, or its gzip stream is broken.
        """
        limit = LARGEST if length is None else min(length, LARGEST)
        if self.size is not None:
            if length is None and self.size > LARGEST:
                raise self._too_large()
            with _sentences(self.path):
                self._stream.seek(0)
                whole = np.fromfile(self._stream, dtype=np.uint8, count=min(self.size, limit))
            whole.flags.writeable = False
            return whole
        data = bytearray(self.head[:limit])
        with _sentences(self.path):
            while len(data) < limit:
                chunk = self._stream.read(min(CHUNK, limit - len(data)))
                if not chunk:
                    break
                data += chunk
            if length is None and len(data) >= LARGEST:
                raise self._too_large()
        return np.frombuffer(bytes(data), dtype=np.uint8)

    def read_text(self) -> Bytes:
        """(n,) the whole file, which must be text.

        Raises
        ------
        CorruptFile : a zero byte, which no text holds; as `read`.
        """
        if not self.is_text:
            raise CorruptFile(
                f"{self.path}: text was expected, but the file holds binary data; check that its suffix is right"
            )
        data = self.read()
        if data.min() == 0:
            where = int(np.argmin(data))
            raise CorruptFile(
                f"{self.path}: text was expected, but byte {where} is zero; the file is damaged, export it again"
            )
        return data

    def _too_large(self) -> CorruptFile:
        return CorruptFile(f"{self.path}: holds more than {LARGEST >> 30} GiB; split it into several files")


TEXT_BYTES = bytes([9, 10, 11, 12, 13, *range(32, 127), *range(128, 256)])


@contextmanager
def source(path: Path) -> Iterator[Source]:
    """The file at `path`, opened and looked at.

    Raises
    ------
    CorruptFile : no such file, a directory, a device, no permission, an empty file, a broken gzip stream.
    """
    with _sentences(path):
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise CorruptFile(f"{path}: is a directory; name a file inside it")
        if not stat.S_ISREG(status.st_mode):
            raise CorruptFile(f"{path}: is not a regular file; copy its content into a file first")
        if status.st_size == 0:
            raise CorruptFile(f"{path}: the file is empty; export it again")
        stream = path.open("rb")
    with stream:
        with _sentences(path):
            head = stream.read(HEAD)
            unpacked = _unpacked(stream, head)
            if unpacked is not None:
                head = unpacked.read(HEAD)
                if not head:
                    raise CorruptFile(f"{path}: the gzip file holds nothing; export it again")
        yield Source(path, head, status.st_size if unpacked is None else None, unpacked or stream)


def _unpacked(stream: BufferedReader, head: bytes) -> IO[bytes] | None:
    """The stream unpacked when it is gzip, else None."""
    if not head.startswith(b"\x1f\x8b"):
        return None
    stream.seek(0)
    return gzip.GzipFile(fileobj=stream, mode="rb")  # type: ignore[return-value]


@contextmanager
def _sentences(path: Path) -> Iterator[None]:
    """What the operating system and gzip complain about, as `CorruptFile`."""
    try:
        yield
    except FileNotFoundError as error:
        raise CorruptFile(f"{path}: there is no such file; check the path") from error
    except PermissionError as error:
        raise CorruptFile(f"{path}: no permission to read it; change its mode or copy it") from error
    except EOFError as error:
        raise CorruptFile(f"{path}: the gzip data ends too early; the file was cut off, fetch it again") from error
    except (gzip.BadGzipFile, zlib.error) as error:
        raise CorruptFile(f"{path}: the gzip data is damaged ({error}); fetch it again") from error
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
        raise CorruptFile(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from error


def line_of(data: Bytes, position: int) -> int:
    """The 1-based line that holds byte `position`."""
    return int(np.count_nonzero(data[:position] == 10)) + 1


def token_at(data: Bytes, position: int) -> str:
    """The word at byte `position`, shortened, printable."""
    words = data[position : position + 24].tobytes().split()
    return words[0].decode("ascii", "replace") if words else "end of file"
