"""Functions run in a child process, so that a native crash or an endless call costs that process and not the caller.

One worker per process is kept warm: a fresh interpreter that imports what it is asked for once. Calls travel as pickles
over its standard streams; whatever native code prints there is dropped. A worker that crashes or overruns its time is
replaced at the next call. Threads take turns.

Time limits are processor time of the worker, so that a slow or busy machine comes to the same result as a fast one. The
clock stops only a call that takes `WALL` times as long.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import os
import pickle
import signal
import struct
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable
from typing import IO, Any

from patchwright.models.errors import EngineError, GeometryError

WALL = 4.0  # times its limit: how long a call may take by the clock

_HEAD = struct.Struct("<Q")
_START = "from patchwright.models.cad.contained import serve; serve()"
# exceptions that travel as they are; any other becomes an EngineError of one sentence
_PLAIN = (GeometryError, OSError, MemoryError, NotImplementedError)


def call(function: Callable[..., Any], *arguments: Any, time_limit: float, what: str, **options: Any) -> Any:
    """`function(*arguments, **options)` in the worker; warnings raised there are raised here.

    Parameters
    ----------
    function : importable by module and name
    time_limit : seconds of processor time
    what : completes "while ..." in the error's sentence

    Raises
    ------
    EngineError : the worker crashed or took longer; errors of `function` itself come through.
    """
    return _call(f"{function.__module__}:{function.__qualname__}", arguments, options, time_limit, what)


def call_named(name: str, *arguments: Any, time_limit: float, what: str, **options: Any) -> Any:
    """The same for a function given as "module:name", which the caller then need not import."""
    return _call(name, arguments, options, time_limit, what)


def spent() -> float:
    """Seconds of processor time that workers have needed for the calls of this thread."""
    return getattr(_mine, "spent", 0.0)


def stop() -> None:
    """End the worker; the next call starts another."""
    with _lock:
        _drop()


def serve() -> None:
    """The worker's loop: read a call from stdin, answer on stdout, until stdin ends."""
    source = os.fdopen(os.dup(0), "rb")
    sink = os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):  # native code prints to these
        os.dup2(nothing, stream)
    gc.disable()  # calls make many objects that live; the garbage is looked for between calls
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt is the caller's to handle
    while True:
        head = source.read(_HEAD.size)
        if len(head) < _HEAD.size:
            os._exit(0)  # native libraries may crash when they are torn down
        (size,) = _HEAD.unpack(head)
        answer = _answer(source.read(size))
        sink.write(_HEAD.pack(len(answer)))
        sink.write(answer)
        sink.flush()
        del answer
        gc.collect()


def _answer(request: bytes) -> bytes:
    caught: list[tuple[type[Warning], str]] = []
    outcome: tuple[bool, Any]
    begun = time.process_time()
    try:
        name, arguments, options, limit = pickle.loads(request)
        _limited(limit)
        module, _, attribute = name.partition(":")
        function = getattr(importlib.import_module(module), attribute)
        with warnings.catch_warnings(record=True) as record:
            warnings.simplefilter("always")
            outcome = True, function(*arguments, **options)
        caught = [(w.category, str(w.message)) for w in record if issubclass(w.category, UserWarning)]
    except _PLAIN as error:
        outcome = False, error
    except Exception as error:  # noqa: BLE001  (native errors have no common base but Exception)
        text = str(error).strip().splitlines()
        outcome = False, EngineError(f"{type(error).__name__}{': ' + text[0] if text else ''}")
    finally:
        _limited(0.0)
    took = time.process_time() - begun
    try:
        return pickle.dumps((*outcome, caught, took), pickle.HIGHEST_PROTOCOL)
    except Exception as error:  # noqa: BLE001
        failure = EngineError(f"the answer cannot be sent: {error}")
        return pickle.dumps((False, failure, [], took), pickle.HIGHEST_PROTOCOL)


def _limited(seconds: float) -> None:
    """End this process once it has used so much more processor time; 0 means never."""
    if hasattr(signal, "setitimer"):  # elsewhere the clock alone is the limit
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, max(seconds, 0.0))


class _Worker:
    """One child process and its streams."""

    def __init__(self) -> None:
        # the child finds the package where this process found it, whatever its working directory
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
        self.process = subprocess.Popen(
            [sys.executable, "-c", _START], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env=environment,
        )  # fmt: skip
        self.owner = os.getpid()

    def exchange(self, request: bytes, time_limit: float) -> bytes | None:
        """The answer, or None when the child ended (or was ended for being late) before it answered."""
        stdin, stdout = self.process.stdin, self.process.stdout
        assert stdin is not None
        assert stdout is not None
        late = threading.Timer(time_limit, self.process.kill)
        late.daemon = True
        late.start()
        try:
            stdin.write(_HEAD.pack(len(request)))
            stdin.write(request)
            stdin.flush()
            head = _exactly(stdout, _HEAD.size)
            return None if head is None else _exactly(stdout, _HEAD.unpack(head)[0])
        except (BrokenPipeError, ConnectionError):
            return None
        finally:
            late.cancel()

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except OSError:
                    continue


def _exactly(stream: IO[bytes], size: int) -> bytes | None:
    data = stream.read(size)
    return data if len(data) == size else None


_lock = threading.RLock()
_mine = threading.local()
_worker: _Worker | None = None


def _drop() -> None:
    global _worker
    if _worker is not None and _worker.owner == os.getpid():
        _worker.end()
    _worker = None


def _call(name: str, arguments: Any, options: Any, time_limit: float, what: str) -> Any:
    global _worker
    request = pickle.dumps((name, arguments, options, time_limit), pickle.HIGHEST_PROTOCOL)
    with _lock:
        if _worker is not None and (_worker.owner != os.getpid() or _worker.process.poll() is not None):
            _drop()
        if _worker is None:
            _worker = _Worker()
        worker, begun = _worker, time.monotonic()
        try:
            answer = worker.exchange(request, WALL * time_limit)
        except BaseException:
            _drop()  # half an answer may be in the pipe
            raise
        if answer is None:
            late = time.monotonic() - begun >= WALL * time_limit
            code = worker.process.wait()
            _drop()
            if late or code == -getattr(signal, "SIGPROF", 0):
                _mine.spent = spent() + time_limit
                raise EngineError(f"the CAD kernel did not finish within {time_limit:.0f} s while {what}")
            raise EngineError(f"the CAD kernel crashed ({_cause(code)}) while {what}")
    done, value, caught, took = _loaded(answer)
    _mine.spent = spent() + took
    for category, text in caught:
        warnings.warn(category(text), stacklevel=4)
    if done:
        return value
    if type(value) is EngineError and "while" not in str(value):
        raise EngineError(f"the CAD kernel failed while {what}: {value}")
    raise value


def _loaded(answer: bytes) -> Any:
    """The unpickled answer; the garbage collector would walk its growing thousands of objects again and again."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        return pickle.loads(answer)
    finally:
        if collecting:
            gc.enable()


def _cause(code: int) -> str:
    if code < 0:
        try:
            return signal.Signals(-code).name
        except ValueError:
            return f"signal {-code}"
    return f"exit code {code}"


atexit.register(_drop)
