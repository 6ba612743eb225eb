"""How kernels are compiled: the one home of numba's options, chosen so that the first run waits as little as possible.

Every kernel is cached, releases the interpreter lock, divides as numpy does (no test of every divisor) and has no
wrapper for C. What it can do without is left out of it: counting references to arrays where it allocates none, the
wrapper for Python where only kernels call it. Arguments that are plain numbers in the source are types of their own
to numba, and compile the callee again: they are written np.int64(0).
"""

from __future__ import annotations

from typing import Any

from numba import njit

_ALWAYS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}

kernel: Any = njit(**_ALWAYS, _nrt=True)  # called from Python, allocates
filling: Any = njit(**_ALWAYS, _nrt=False)  # called from Python, only fills arrays it is given
inner: Any = njit(**_ALWAYS, _nrt=False, no_cpython_wrapper=True)  # called by kernels, allocates nothing
making: Any = njit(**_ALWAYS, _nrt=True, no_cpython_wrapper=True)  # called by kernels, allocates
inlined: Any = njit(**_ALWAYS, _nrt=False, no_cpython_wrapper=True, forceinline=True)  # `inner`, put into its caller
