"""VTK's XML files written by hand: elements and data arrays in base64.

Form: "VTK XML Formats", https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html (inline binary
data: the length in bytes, then the data, together in base64).
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable
from typing import IO
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

TYPES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


def header(kind: str) -> bytes:
    """The opening of a VTK file of `kind` ("PolyData", "StructuredGrid", "vtkMultiBlockDataSet")."""
    return (
        '<?xml version="1.0"?>\n'
        f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n<{kind}>\n'
    ).encode()


def footer(kind: str) -> bytes:
    """The end of a VTK file of `kind`."""
    return f"</{kind}>\n</VTKFile>\n".encode()


def data_array(name: str, values: npt.NDArray[np.generic]) -> bytes:
    """A data array of (n,) scalars or (n, k) tuples."""
    little = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    body = b64encode(np.array(little.nbytes, dtype="<u8").tobytes() + little.tobytes())
    components = "" if values.ndim == 1 else f' NumberOfComponents="{values.shape[1]}"'
    kind = TYPES[values.dtype.str[1:]]
    return (
        f'<DataArray type="{kind}" Name={quoteattr(name)}{components} format="binary">'.encode()
        + body
        + b"</DataArray>\n"
    )


def string_array(name: str, words: Iterable[str]) -> bytes:
    """An array of strings, one tuple each, as the numbers of their UTF-8 bytes ended by zero."""
    texts = [word.encode() + b"\0" for word in words]
    numbers = " ".join(str(byte) for text in texts for byte in text)
    head = f'<Array type="String" Name={quoteattr(name)} NumberOfTuples="{len(texts)}" format="ascii">'
    return f"{head}{numbers}</Array>\n".encode()


def section(out: IO[bytes], name: str, arrays: Iterable[bytes]) -> None:
    """One element that holds data arrays."""
    out.write(f"<{name}>\n".encode())
    for array in arrays:
        out.write(array)
    out.write(f"</{name}>\n".encode())
