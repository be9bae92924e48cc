"""``python -m faceoff.challenge_2023``: makes a bundle from a team's folder of 2023."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from faceoff.challenge_2023._bundle import RUNTIME, make_bundle
from faceoff.errors import Error


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command.

    Returns:
        The exit code: 0, or 1 after an error, with one line on standard error.
    """
    parser = argparse.ArgumentParser(
        prog="python -m faceoff.challenge_2023",
        description="Makes a bundle from an agent of the 2023 Robot Air Hockey Challenge.",
    )
    parser.add_argument("folder", help="the package air_hockey_agent with agent_builder.py, or the folder above it")
    parser.add_argument("bundle", help="the folder to make")
    parser.add_argument("--name", help="the agent's name on the board [default: the bundle's folder]")
    parser.add_argument("--runtime", default=RUNTIME, help="a runtime of the server with NumPy [default: %(default)s]")
    options = parser.parse_args(arguments)
    try:
        make_bundle(options.folder, options.bundle, name=options.name, runtime=options.runtime)
    except (Error, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"{options.bundle}: try it with\n  faceoff eval {options.bundle} --episodes 20")
    return 0


if __name__ == "__main__":
    sys.exit(main())
