"""`agent_config.yml` of 2023: the interpolation order, and arguments for `build_agent`."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from faceoff.agent import SHAPES
from faceoff.challenge_2023._arguments import one_of
from faceoff.errors import ArgumentError, ArgumentTypeError

DEFAULT_ORDER = 3
"""The interpolation order of 2023 unless the configuration had another one."""

#: Settings of the evaluation of 2023, which `build_agent` did not get.
_FRAMEWORK = (
    "env",
    "env_list",
    "log_dir",
    "n_episodes",
    "n_cores",
    "seed",
    "generate_score",
    "quiet",
    "render",
    "host",
    "port",
    "steps_per_game",
    "friendship_game",
)
_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9_]*)")
_FLOAT = re.compile(r"[-+]?([0-9][0-9_]*\.[0-9_]*|\.[0-9][0-9_]*)([eE][-+][0-9]+)?")
_CONSTANTS: dict[str, bool | None] = {
    "": None,
    "~": None,
    "null": None,
    "true": True,
    "yes": True,
    "on": True,
    "false": False,
    "no": False,
    "off": False,
}


def interpolation_order(config: Mapping[str, Any]) -> int | None:
    """The order that a configuration sets, or the default of 2023."""
    order = config.get("interpolation_order", DEFAULT_ORDER)
    one_of("interpolation_order", order, SHAPES)
    return order  # type: ignore[no-any-return]


def builder_arguments(config: Mapping[str, Any], task: str) -> dict[str, Any]:
    """What `build_agent` got in 2023 beside `env_info`; the interpolation order in games only."""
    arguments = {key: value for key, value in config.items() if key not in _FRAMEWORK}
    if task != "tournament":
        arguments.pop("interpolation_order", None)
    return arguments


def read_config(path: Path) -> dict[str, Any]:
    """A configuration file; empty if there is none. The result has only what JSON can express.

    Read with PyYAML if it is installed; else keys with numbers, words and one-line lists are understood.
    """
    if not path.exists():
        return {}
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ArgumentError(f"{path}: expected a YAML file in UTF-8, got {error}") from error
    config = _parse(path, text)
    if config is None:
        return {}
    if not isinstance(config, dict) or not all(isinstance(key, str) for key in config):
        raise ArgumentTypeError(f"{path}: expected keys with values, got {config!r:.80}")
    try:
        json.dumps(config, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ArgumentTypeError(
            f"{path}: expected numbers, words, lists and keys with values, got {error}; compute other "
            "values in build_agent"
        ) from error
    interpolation_order(config)
    return config


def _parse(path: Path, text: str) -> Any:
    try:
        import yaml
    except ImportError:
        return _parse_lines(path, text)
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ArgumentError(f"{path}: expected YAML, got {' '.join(str(error).split())}") from error


def _parse_lines(path: Path, text: str) -> dict[str, Any]:
    config: dict[str, Any] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        content = _without_comment(line).rstrip()
        if not content or content == "---":
            continue
        key, colon, value = content.partition(":")
        try:
            if not colon or not re.fullmatch(r"\w[\w-]*", key) or (value and value[0] != " "):
                raise ValueError
            config[key] = _value(value.strip())
        except ValueError:
            raise ArgumentError(
                f"{path}: line {number}: expected a key and a number, word or one-line list, got "
                f"{content!r:.80}; install PyYAML (pip install pyyaml) for other YAML"
            ) from None
    return config


def _without_comment(line: str) -> str:
    quote = ""
    for index, character in enumerate(line):
        if quote:
            quote = "" if character == quote else quote
        elif character in "'\"":
            quote = character
        elif character == "#" and (index == 0 or line[index - 1] in " \t"):
            return line[:index]
    return line


def _value(text: str) -> Any:
    """A value as PyYAML reads it; ValueError for everything that is not simple."""
    if text.startswith("["):
        if not text.endswith("]") or any(character in text[1:-1] for character in "[]{}"):
            raise ValueError
        inner = text[1:-1].strip()
        return [_value(element.strip()) for element in inner.split(",")] if inner else []
    if len(text) >= 2 and text[0] in "'\"" and text[-1] == text[0]:
        if text[0] in text[1:-1] or "\\" in text:
            raise ValueError
        return text[1:-1]
    if text.lower() in _CONSTANTS and text in (text.lower(), text.capitalize(), text.upper()):
        return _CONSTANTS[text.lower()]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    # Dates, other bases and times begin with a digit; the rest are special characters of YAML.
    if not re.fullmatch(r"[A-Za-z_/][\w ./+-]*", text):
        raise ValueError
    return text
