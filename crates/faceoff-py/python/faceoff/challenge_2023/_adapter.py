"""An agent of 2023 as an agent of the protocol."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from faceoff.agent import SHAPES, Agent, run
from faceoff.challenge_2023._arguments import Floats, path_of
from faceoff.challenge_2023._config import builder_arguments, interpolation_order
from faceoff.challenge_2023._env_info import env_info
from faceoff.challenge_2023._loading import Builder, checked_builder, explain, load_builder
from faceoff.errors import ArgumentError, ArgumentTypeError, OrderError

TEAM_FOLDER = "team"
"""The folder of a bundle with the team's files, unchanged."""

CONFIG_FILE = "agent_config.json"
"""The file of a bundle with the content of `agent_config.yml`."""


class Adapter(Agent):
    """Plays an agent of 2023: `build_agent` at the start, `episode_start` and `draw_action` as in 2023.

    `adapt` and `play` make classes derived from it.
    """

    config: ClassVar[Mapping[str, Any]] = {}
    """The content of `agent_config.yml`."""

    agent: Any
    """The agent of 2023."""

    @staticmethod
    def load() -> Builder:
        """Returns `build_agent`."""
        raise OrderError(
            "Adapter: expected a class made by adapt, got Adapter; call adapt(build_agent) and use its result"
        )

    def start(self) -> None:
        self.interpolation = interpolation_order(self.config)
        build_agent = type(self).load()
        info = env_info(self.task, self.agent_id, self.env)
        try:
            self.agent = build_agent(info, **builder_arguments(self.config, self.task))
        except ImportError as error:
            raise explain(error) from error
        for method in ("draw_action", "reset"):
            if not callable(getattr(self.agent, method, None)):
                raise ArgumentTypeError(
                    f"build_agent: expected an agent with {method}, got {type(self.agent).__name__}; "
                    "derive its class from AgentBase"
                )

    def reset(self) -> None:
        getattr(self.agent, "episode_start", self.agent.reset)()

    def act(self, observation: list[float]) -> Any:
        state: Floats = np.array(observation, dtype=np.float64)
        for preprocessor in getattr(self.agent, "preprocessors", ()):
            state = preprocessor(state)
        return _checked_action(self.agent.draw_action(state), self.interpolation)


def adapt(build_agent: Callable[..., Any], config: Mapping[str, Any] | None = None) -> type[Adapter]:
    """A class of agents for `faceoff.agent.run`, from `build_agent` and the content of `agent_config.yml`.

    For example `run(adapt(build_agent, {"interpolation_order": 3}))`.
    """
    builder = checked_builder(build_agent)
    if config is not None and not isinstance(config, Mapping):
        raise ArgumentTypeError(f"config: expected a mapping of settings, got {config!r:.80}")
    settings = dict(config or {})
    interpolation_order(settings)
    return _adapted(lambda: builder, settings)


def play(bundle: str | Path) -> None:
    """Plays the agent of a converted bundle over standard input and output: the program of the bundle."""
    folder = path_of("bundle", bundle, "a folder").resolve()
    path = folder / CONFIG_FILE
    try:
        config = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ArgumentError(
            f"bundle: expected a folder made by python -m faceoff.challenge_2023, got {str(bundle)!r}: {error}"
        ) from error
    # The team's code is imported after `run` has moved standard output to the log: an import may print.
    run(_adapted(lambda: load_builder(folder / TEAM_FOLDER), config))


def _adapted(load: Callable[[], Builder], config: Mapping[str, Any]) -> type[Adapter]:
    return type("Adapted", (Adapter,), {"load": staticmethod(load), "config": config})


def _checked_action(action: Any, order: int | None) -> Floats:
    """The action as an array of the shape that the order requires; surplus rows are cut off, as in 2023."""
    shape = SHAPES[order]
    try:
        numbers: Floats = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.ndim == len(shape) and numbers.shape[1:] == shape[1:] and len(numbers) >= shape[0]:
        return numbers[: shape[0]]
    got = f"shape {numbers.shape}" if numbers.size else f"{action!r:.80}"
    raise ArgumentError(
        f"draw_action: expected an array of shape {shape} for interpolation order {order}, got {got}; "
        "return that shape, or set interpolation_order in agent_config.yml"
    )
