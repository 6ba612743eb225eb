"""Array types and the copy that makes a value's arrays its own."""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
T = TypeVar("T", bound=np.generic)


def frozen(values: npt.ArrayLike, dtype: type[T]) -> npt.NDArray[T]:
    """A read-only, C-contiguous copy of `values`; an array already frozen is returned as it is.

    An array counts as frozen when neither it nor any array it is a view of can be written to.
    """
    if isinstance(values, np.ndarray) and values.dtype == np.dtype(dtype) and values.flags.c_contiguous:
        owner: Any = values
        while isinstance(owner, np.ndarray) and not owner.flags.writeable:
            if owner.base is None:
                return values
            owner = owner.base
    copy = np.array(values, dtype=dtype, order="C", copy=True)
    copy.flags.writeable = False
    return copy
