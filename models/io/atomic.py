"""Writing a file so that it is either whole or not there: written beside its target, then renamed."""

from __future__ import annotations

import gzip
import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, cast

from patchwright.models.errors import ParameterError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to; on success it takes the place of `path`, on failure it is removed.

    An existing file keeps its permissions; a link is followed.

    Raises
    ------
    ParameterError : a directory in the way, a missing folder, no permission, no space.
    """
    target = path.resolve()
    if target.is_dir():
        raise ParameterError(f"{path}: cannot be written, it is a directory; name a file inside it")
    if not target.parent.is_dir():
        raise ParameterError(f"{path}: cannot be written, the folder {target.parent} does not exist; make it first")
    if target.exists() and not os.access(target, os.W_OK):
        raise ParameterError(f"{path}: cannot be written, the existing file is write-protected")
    # the suffix stays last: CAD kernels pick the format by it
    beside = target.with_name(f".{uuid.uuid4().hex[:12]}-{target.name}")
    try:
        yield beside
        if target.exists():
            shutil.copymode(target, beside)
        beside.replace(target)
    except OSError as error:
        raise ParameterError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        beside.unlink(missing_ok=True)


@contextmanager
def writing(path: Path) -> Iterator[IO[bytes]]:
    """A binary stream whose content becomes the file `path` when the block ends well; packed when it ends in ".gz".

    Raises
    ------
    ParameterError : as `replacing`.
    """
    with replacing(path) as beside:
        if path.name.lower().endswith(".gz"):
            with beside.open("wb") as raw, gzip.GzipFile("", "wb", 6, raw, mtime=0) as packed:
                yield cast(IO[bytes], packed)
        else:
            with beside.open("wb") as raw:
                yield raw
