"""Tests import what they share from this folder; where all is installed that they need, none may be skipped."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A skipped test fails the run that `test.sh test` makes: its environment has everything."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if "FACEOFF_SKIP_NOTHING" in os.environ and reporter is not None and reporter.stats.get("skipped"):
        reporter.write_line("skipped, and nothing may be", red=True)
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
