"""Limits sessions of ONNX Runtime to as many threads as the sandbox has CPUs.

ONNX Runtime reads its number of threads from no environment variable. By default it starts one thread per CPU that it
finds and binds each thread to a CPU, which fails under a cpuset. Numbers that an agent sets are kept.

A .pth file loads this module at each start of the interpreter; it has no cost until onnxruntime is imported.
"""

import os
import sys
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any, Sequence


def threads() -> int:
    """The number of threads to use: OMP_NUM_THREADS, or the number of available CPUs."""
    value = os.environ.get("OMP_NUM_THREADS", "")
    return int(value) if value.isdecimal() and int(value) > 0 else len(os.sched_getaffinity(0))


def limit(onnxruntime: ModuleType) -> None:
    """Makes the module's sessions use :func:`threads` threads, unless their options set a number."""
    session = onnxruntime.InferenceSession
    start = session.__init__

    def start_limited(self: Any, path_or_bytes: Any, sess_options: Any = None, *args: Any, **kwargs: Any) -> None:
        options = onnxruntime.SessionOptions() if sess_options is None else sess_options
        if options.intra_op_num_threads == 0:
            options.intra_op_num_threads = threads()
        if options.inter_op_num_threads == 0:
            options.inter_op_num_threads = threads()
        start(self, path_or_bytes, options, *args, **kwargs)

    session.__init__ = start_limited


class ImportHook:
    """Waits on ``sys.meta_path`` for the import of onnxruntime, and then removes itself."""

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Finds onnxruntime like Python, and limits it when it is loaded; ignores other modules."""
        if name != "onnxruntime":
            return None
        sys.meta_path.remove(self)
        spec = PathFinder.find_spec(name, path)
        if spec is not None and spec.loader is not None:
            run = spec.loader.exec_module

            def run_and_limit(module: ModuleType) -> None:
                run(module)
                limit(module)

            spec.loader.exec_module = run_and_limit  # type: ignore[method-assign]
        return spec


sys.meta_path.insert(0, ImportHook())
