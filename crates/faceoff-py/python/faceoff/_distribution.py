"""The name under which this package is distributed; the import name `faceoff` belongs to another project on PyPI."""

#: Also in ``pyproject.toml``; the tests compare both, and all commands in the documentation.
DISTRIBUTION = "faceoff-robotics"


def install_command(extra: str) -> str:
    """The command that installs the packages of an extra, such as ``gym``."""
    return f"pip install '{DISTRIBUTION}[{extra}]'"
