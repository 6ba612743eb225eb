"""A crash or an endless call in the worker costs the worker, never the caller."""

from __future__ import annotations

import math
import os
import threading
import time
import warnings

import numpy as np
import pytest

from patchwright.models import EngineError, ParameterError
from patchwright.models.cad.contained import call, call_named, spent


def test_values_errors_and_warnings_come_through() -> None:
    assert call(math.hypot, 3.0, 4.0, time_limit=30, what="adding") == 5.0
    with pytest.raises(FileNotFoundError):
        call(os.stat, "/nowhere/at/all", time_limit=30, what="looking")
    with pytest.raises(EngineError, match="while rooting: ValueError"):
        call(math.sqrt, -1.0, time_limit=30, what="rooting")
    with pytest.warns(UserWarning, match="mind the gap"):
        call(warnings.warn, "mind the gap", time_limit=30, what="warning")
    with pytest.raises(ParameterError):
        call_named("patchwright.models.analytic:Sphere", (0, 0, 0), -1.0, time_limit=30, what="shaping")


def test_crash_is_an_error_and_the_next_call_works() -> None:
    with pytest.raises(EngineError, match=r"crashed .* while falling"):
        call(os.abort, time_limit=30, what="falling")
    assert call(abs, -2, time_limit=30, what="standing") == 2


def test_segmentation_fault_is_named() -> None:
    with pytest.raises(EngineError, match="SIGSEGV"):
        call_named("ctypes:string_at", 0, time_limit=30, what="reading nothing")


def test_endless_call_ends_at_its_limit() -> None:
    begun = time.monotonic()
    with pytest.raises(EngineError, match="within 1 s while waiting"):
        call(time.sleep, 60, time_limit=1.0, what="waiting")
    assert time.monotonic() - begun < 10.0
    assert call(abs, -3, time_limit=30, what="going on") == 3


def test_the_limit_is_of_work_and_the_work_is_counted() -> None:
    call(abs, 1, time_limit=30, what="starting")
    before = spent()
    call(time.sleep, 0.6, time_limit=0.5, what="waiting")  # longer by the clock, but hardly any work
    assert spent() - before < 0.5
    with pytest.raises(EngineError, match="within 1 s while counting"):
        call(sum, range(10**11), time_limit=1.0, what="counting")
    assert spent() - before >= 1.0
    counted: list[float] = []
    other = threading.Thread(target=lambda: counted.append(spent()))
    other.start()
    other.join()
    assert counted == [0.0]  # each thread has its own account


def test_large_arrays_travel_whole() -> None:
    array = np.random.default_rng(0).random((1000, 1000))
    assert np.array_equal(call(np.ascontiguousarray, array, time_limit=60, what="copying"), array)


def test_threads_take_turns() -> None:
    got: dict[int, float] = {}

    def work(i: int) -> None:
        got[i] = call(math.sqrt, float(i * i), time_limit=60, what="rooting")

    threads = [threading.Thread(target=work, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert got == {i: float(i) for i in range(8)}
