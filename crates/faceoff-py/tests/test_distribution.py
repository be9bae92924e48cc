"""The distribution's name: the import name `faceoff` belongs to another project on PyPI, so no command may install that."""

import re
import subprocess
import tomllib
from importlib import metadata
from pathlib import Path

import faceoff
from faceoff._distribution import DISTRIBUTION, install_command

ROOT = Path(__file__).resolve().parents[3]
PROJECT = tomllib.loads((ROOT / "crates/faceoff-py/pyproject.toml").read_text())["project"]
#: A requirement `faceoff` or `faceoff[extra]` among the arguments of pip, and a wheel's file of that name.
FOREIGN_REQUIREMENT = re.compile(r"pip install[^\n]*?[\s'\"]faceoff(\[|['\"\s`]|$)|wheels?/faceoff-")


def test_installed_package_has_the_distribution_name() -> None:
    assert PROJECT["name"] == DISTRIBUTION
    assert metadata.version(DISTRIBUTION) == faceoff.__version__
    assert "faceoff" in metadata.packages_distributions()
    assert metadata.packages_distributions()["faceoff"] == [DISTRIBUTION]


def test_install_commands_name_existing_extras() -> None:
    assert install_command("gym") == f"pip install '{DISTRIBUTION}[gym]'"
    sources = Path(faceoff.__file__).parent.rglob("*.py")
    used = {extra for source in sources for extra in re.findall(r"install_command\(['\"](\w+)", source.read_text())}
    assert used >= {"gym", "games", "dataset"}
    assert used <= set(PROJECT["optional-dependencies"])


def test_no_command_installs_the_foreign_package() -> None:
    assert FOREIGN_REQUIREMENT.search("pip install 'faceoff[gym]'")
    assert FOREIGN_REQUIREMENT.search("pip install faceoff")
    assert not FOREIGN_REQUIREMENT.search(install_command("gym"))
    listed = subprocess.run(
        ["git", "-C", ROOT, "ls-files", "-z", "*.md", "*.py", "*.rs", "*.html", "*.toml", "*.sh", "Makefile"],
        check=True, capture_output=True, text=True,
    )
    paths = [path for path in listed.stdout.split("\0") if path and not path.endswith("test_distribution.py")]
    assert len(paths) > 500
    found = {
        path: match.group(0)
        for path in paths
        if (match := FOREIGN_REQUIREMENT.search((ROOT / path).read_text(errors="replace")))
    }
    assert found == {}
