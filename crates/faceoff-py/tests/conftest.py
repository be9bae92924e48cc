"""Makes this folder importable for shared code; forbids skipped tests where all dependencies are installed."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A skipped test fails a run of `test.sh test`, whose environment has all dependencies."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if "FACEOFF_SKIP_NOTHING" in os.environ and reporter is not None and reporter.stats.get("skipped"):
        reporter.write_line("expected no skipped test (FACEOFF_SKIP_NOTHING is set)", red=True)
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
