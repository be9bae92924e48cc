"""Gives sessions of ONNX Runtime as many threads as the sandbox says that there are CPUs for.

ONNX Runtime takes its number of threads from no environment variable. Left alone it starts one for each CPU that it
finds and binds each to one of them, which fails under a cpuset. What an agent sets itself stays as it is.

Loaded at each start of the interpreter, by a .pth file; it costs nothing until onnxruntime is imported.
"""

import os
import sys
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any, Sequence


def threads() -> int:
    """The number of threads to use: that of OMP_NUM_THREADS, or else one for each CPU that may be used."""
    told = os.environ.get("OMP_NUM_THREADS", "")
    return int(told) if told.isdecimal() and int(told) > 0 else len(os.sched_getaffinity(0))


def limit(onnxruntime: ModuleType) -> None:
    """Has the module's sessions use :func:`threads` threads, where their options leave the number open."""
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


class Watch:
    """Waits on ``sys.meta_path`` for the import of onnxruntime, and leaves with it."""

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Finds onnxruntime as Python would, and has it limited once it is loaded; no other module."""
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


sys.meta_path.insert(0, Watch())
