"""Processes that run parts of an evaluation.

They are started by a command, not by `multiprocessing`: they do not import the caller's script again, so a script needs no
``if __name__ == "__main__"``, and a policy may be defined anywhere, also in a notebook. For that it is pickled by value,
which needs cloudpickle (Gymnasium installs it); without it, the policy must be importable.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from typing import Any

from faceoff.errors import ArgumentTypeError, Error

#: A worker's program. Its standard input begins with the caller's `sys.path`, so that it finds the same packages.
PROGRAM = "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer); from faceoff._workers import main; main()"


def pickle_value(name: str, value: object) -> bytes:
    """``value`` for a worker; ``name`` is the argument's, for the error message."""
    try:
        data = _dump(value)
    except Exception as error:
        hint = "keep open files, locks and loggers out of it" if _pickles_by_value() else "pip install cloudpickle"
        raise ArgumentTypeError(
            f"{name}: expected one that can be sent to other processes, got one that cannot ({error}): {hint}, or use "
            "workers=1"
        ) from None
    # A worker has another main module.
    if b"__main__" in data and not _pickles_by_value():
        raise ArgumentTypeError(
            f"{name}: expected one defined in a module, got one of the script or session itself, which other processes "
            "cannot import: pip install cloudpickle, put it in a module, or use workers=1"
        )
    return data


def _pickles_by_value() -> bool:
    """Whether cloudpickle is installed."""
    try:
        import cloudpickle  # noqa: F401
    except ImportError:
        return False
    return True


def _dump(value: object) -> bytes:
    if not _pickles_by_value():
        return pickle.dumps(value)
    import cloudpickle

    data: bytes = cloudpickle.dumps(value)
    return data


def run_in_workers(function: Callable[..., list[Any]], jobs: Sequence[tuple[bytes, tuple[Any, ...]]]) -> list[Any]:
    """Calls ``function(value, *arguments)`` for each job in a process of its own; a job has the pickled value and the arguments.

    Returns the concatenated results in the order of the jobs.

    Raises:
        Error: a process ended without a result. Exceptions of the function are raised as they are.
    """
    if not sys.executable:
        raise Error("workers: expected an interpreter that can be started, got an embedded one: use workers=1")
    processes: list[subprocess.Popen[bytes]] = []
    try:
        for _ in jobs:
            processes.append(
                subprocess.Popen([sys.executable, "-P", "-c", PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
            )
        path = pickle.dumps(sys.path)
        requests = [path + pickle.dumps((function, value, arguments)) for value, arguments in jobs]
        with ThreadPoolExecutor(len(jobs)) as threads:
            futures = [threads.submit(_read_result, *pair) for pair in zip(processes, requests, strict=True)]
            try:
                done, _ = wait(futures, return_when=FIRST_EXCEPTION)
                failed = [future for future in futures if future in done and future.exception() is not None]
                # After an error the results of the others would be thrown away, so they are not waited for.
                return [outcome for future in failed or futures for outcome in future.result()]
            finally:
                _end(processes)
    finally:
        _end(processes)


def _end(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()


def _read_result(process: subprocess.Popen[bytes], request: bytes) -> list[Any]:
    assert process.stdin is not None and process.stdout is not None
    try:
        # Standard input stays open: its end tells the worker that this process is gone.
        process.stdin.write(request)
        process.stdin.flush()
    except BrokenPipeError:
        pass
    answer = process.stdout.read()
    process.wait()
    if process.returncode != 0 or not answer:
        raise Error(
            f"workers: expected a result of each process, but one ended with status {process.returncode}; its last output "
            "is above; a negative status is a signal, and -9 often means that memory was short: use fewer workers"
        )
    kind, content, text = pickle.loads(answer)
    if kind == "outcomes":
        outcomes: list[Any] = content
        return outcomes
    try:
        error = pickle.loads(content)
    except Exception:
        error = None
    if not isinstance(error, Exception):
        raise Error(f"the policy failed in a worker:\n{text}")
    raise error from Error(f"in a worker:\n{text}")


def main() -> None:
    """Runs the job that standard input contains, and writes its result to standard output."""
    # Prints of a policy must not get between the result.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    try:
        function, value, arguments = pickle.load(sys.stdin.buffer)
        threading.Thread(target=_end_with_parent, daemon=True).start()
        result: tuple[str, Any, str] = ("outcomes", function(pickle.loads(value), *arguments), "")
    except Exception as error:
        text = "".join(traceback.format_exception(error))
        try:
            # Also exceptions that the caller's script defines.
            content = _dump(error)
        except Exception:
            content = b""
        result = ("error", content, text)
    answers.write(pickle.dumps(result))
    answers.close()


def _end_with_parent() -> None:
    """Ends this process when the one that started it is gone, however it ended."""
    # Not the buffered reader: its lock would be held at the end of the interpreter.
    while os.read(0, 4096):
        pass
    os._exit(1)
