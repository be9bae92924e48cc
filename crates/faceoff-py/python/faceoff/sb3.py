"""The vector environment as Stable-Baselines3 expects it.

Stable-Baselines3 has its own interface for vector environments, older than Gymnasium's. :func:`make_vec_env` returns
a Faceoff environment with that interface::

    from stable_baselines3 import PPO
    import faceoff.sb3
    envs = faceoff.sb3.make_vec_env("defend", 64, profile="evaluation", clip_actions=True)
    PPO("MlpPolicy", envs).learn(1_000_000)

Stable-Baselines3 needs torch, so only that call imports it. The *infos* of a step are dictionaries in
Stable-Baselines3, one per world; in Gymnasium's vector environments they are arrays with masks.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from faceoff._arguments import integer, known_names
from faceoff.errors import ArgumentError, ArgumentTypeError, MissingError
from faceoff.gym.mallet import MalletPlaneVector
from faceoff.gym.vector import AirHockeyVectorEnv, read_seeds

#: Result of a step in Stable-Baselines3: observations, rewards, dones, and the infos of each world.
Step = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], npt.NDArray[np.bool_], list[dict[str, Any]]]


class VecEnvMethods:
    """The methods of Stable-Baselines3's ``VecEnv``, without that base class.

    The step that ends an episode also begins the next one. Its info has ``terminal_observation``,
    ``TimeLimit.truncated`` (truncated, not terminated) and ``is_success`` for Stable-Baselines3, and all keys of
    :class:`faceoff.gym.AirHockeyEnv`.
    """

    envs: AirHockeyVectorEnv | MalletPlaneVector
    num_envs: int
    reset_infos: list[dict[str, Any]]
    _worlds: AirHockeyVectorEnv
    _seeds: list[int | None]

    def __init__(self, envs: AirHockeyVectorEnv | MalletPlaneVector) -> None:
        worlds = envs.env if isinstance(envs, MalletPlaneVector) else envs
        if not isinstance(worlds, AirHockeyVectorEnv) or worlds.autoreset_mode.name != "SAME_STEP":
            raise ArgumentTypeError(
                "envs: expected an AirHockeyVectorEnv made with autoreset_mode='SameStep', or a MalletPlaneVector "
                f"around one, got {envs!r:.80}"
            )
        self._worlds = worlds
        self.envs = envs
        self.num_envs = envs.num_envs
        self.render_mode = envs.render_mode
        # The constructor of Stable-Baselines3's class reads attributes, so they are set first.
        self._init_spaces(envs)
        # Recorders read the speed of their videos from it.
        self.metadata = dict(envs.metadata)
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._seeds = [None] * self.num_envs

    def _init_spaces(self, envs: AirHockeyVectorEnv | MalletPlaneVector) -> None:
        self.observation_space = envs.single_observation_space
        self.action_space = envs.single_action_space

    def seed(self, seed: int | None = None) -> list[int | None]:
        """Sets the seeds of the next reset: s, s + 1, …; s is random if left out."""
        if seed is None:
            seed = int(np.random.default_rng().integers(2**32))
        self._seeds = read_seeds(seed, self.num_envs, "worlds")
        return list(self._seeds)

    def reset(self) -> npt.NDArray[np.float32]:
        """Begins an episode in every world; its infos are in ``reset_infos``."""
        is_seeded = any(seed is not None for seed in self._seeds)
        observations, infos = self.envs.reset(seed=self._seeds if is_seeded else None)
        self._seeds = [None] * self.num_envs
        self.reset_infos = split_infos(infos, self.num_envs)
        return observations

    def step_async(self, actions: Any) -> None:
        """Begins a step in other threads."""
        self.envs.send(actions)

    def step_wait(self) -> Step:
        """Waits for the step that :meth:`step_async` began."""
        observations, rewards, terminated, truncated, batched = self.envs.recv()
        dones = terminated | truncated
        infos = split_infos(batched, self.num_envs)
        for world in np.flatnonzero(dones):
            final = infos[world].pop("final_info")
            self.reset_infos[world] = {
                name: infos[world].pop(name) for name in ("seed", "episode_number")
            }
            infos[world] |= final
            infos[world]["terminal_observation"] = infos[world].pop("final_obs")
            infos[world]["is_success"] = final["success"]
        for index, info in enumerate(infos):
            info["TimeLimit.truncated"] = bool(truncated[index] and not terminated[index])
        return observations, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Releases worlds and threads."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the vector environment, once per world."""
        return [getattr(self.envs, attr_name) for _ in self._indices(indices)]

    def has_attr(self, attr_name: str) -> bool:
        """Whether the vector environment has the attribute."""
        return hasattr(self.envs, attr_name)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused: all worlds have the same fixed arguments."""
        raise ArgumentError(
            f"set_attr: expected no change to a world, got {attr_name!r}: make the environments with other arguments"
        )

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Only ``render`` is supported: worlds have no other methods of their own."""
        if method_name != "render":
            raise ArgumentError(
                f"env_method: expected render, since worlds have no other method of their own, got {method_name!r}"
            )
        frames = self._worlds.render()
        return [frames[index] for index in self._indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """False for each world: worlds have no wrappers."""
        return [False for _ in self._indices(indices)]

    def get_images(self) -> Sequence[npt.NDArray[np.uint8] | None]:
        """A picture of each world, for ``rgb_array``."""
        return self._worlds.render() if self.render_mode == "rgb_array" else [None] * self.num_envs

    def _indices(self, indices: None | int | Iterable[int]) -> list[int]:
        if indices is None:
            return list(range(self.num_envs))
        return [indices] if isinstance(indices, int) else list(indices)


def split_infos(batched: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """Converts arrays with masks into one dictionary per world."""
    infos: list[dict[str, Any]] = [{} for _ in range(count)]
    for name, values in batched.items():
        if name.startswith("_"):
            continue
        present = np.flatnonzero(batched[f"_{name}"])
        if isinstance(values, dict):
            inner = split_infos(values, count)
            for world in present:
                infos[world][name] = inner[world]
        else:
            for world in present:
                value = values[world]
                infos[world][name] = value.item() if isinstance(value, np.generic) else value
    return infos


def make_vec_env(
    task: str = "defend",
    n_envs: int = 1,
    *,
    seed: int | None = None,
    mallet_speed_m_s: float | None = None,
    **env_arguments: Any,
) -> Any:
    """A ``stable_baselines3.common.vec_env.VecEnv`` of ``n_envs`` worlds.

    Args:
        task, env_arguments: as for :class:`faceoff.gym.AirHockeyVectorEnv`, without ``autoreset_mode``.
        n_envs: number of worlds.
        seed: s for the seeds s, s + 1, … of the first reset.
        mallet_speed_m_s: wraps the worlds in :class:`faceoff.gym.MalletPlaneVector` with this maximum speed: actions
            are then (2,) mallet velocities as shares of it.

    Raises:
        MissingError: if Stable-Baselines3 is not installed.
    """
    if "autoreset_mode" in env_arguments:
        raise ArgumentError("autoreset_mode: expected no value, since Stable-Baselines3 has a single mode, got one")
    count = integer("n_envs", n_envs, 1, 1_000_000)
    own = ("num_envs", "task", "autoreset_mode")
    known = [name for name in inspect.signature(AirHockeyVectorEnv).parameters if name not in own]
    known_names("make_vec_env", env_arguments, known)
    try:
        from stable_baselines3.common.vec_env import VecEnv
    except ImportError as error:
        raise MissingError("faceoff.sb3 needs Stable-Baselines3: pip install stable-baselines3") from error

    class FaceoffVecEnv(VecEnvMethods, VecEnv):  # type: ignore[misc]
        """Worlds of a task, for Stable-Baselines3."""

        def _init_spaces(self, envs: AirHockeyVectorEnv | MalletPlaneVector) -> None:
            VecEnv.__init__(self, envs.num_envs, envs.single_observation_space, envs.single_action_space)

    if mallet_speed_m_s is not None:
        # The only arguments that the wrapper accepts.
        env_arguments = {"action_mode": "raw", "interpolation": 3, **env_arguments}
    envs: AirHockeyVectorEnv | MalletPlaneVector
    envs = AirHockeyVectorEnv(count, task, autoreset_mode="SameStep", **env_arguments)  # type: ignore[arg-type]
    if mallet_speed_m_s is not None:
        envs = MalletPlaneVector(envs, mallet_speed_m_s)
    env = FaceoffVecEnv(envs)
    if seed is not None:
        env.seed(seed)
    return env
