"""Actions shared by several tests: commands with which an agent makes its world *diverge*, that is, move faster than
the simulator's bounds."""

import numpy as np

from faceoff.gym import AirHockeyEnv


def runaway_action(q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """A raw trajectory action, (420,), that accelerates every joint in its direction of motion."""
    sign = np.where(dq >= 0.0, 1.0, -1.0)
    return np.tile(np.concatenate([q + 3.0 * sign, 1e4 * sign, 1e4 * sign]), 20)


def diverging_actions() -> tuple[AirHockeyEnv, list[np.ndarray]]:
    """An environment at the start of episode 0 of ``prepare``, seed 0, and actions that make its world diverge."""
    env = AirHockeyEnv("prepare", interpolation=None, action_mode="raw")
    env.reset(seed=0)
    start = env.save()
    actions, ended = [], False
    while not ended:
        state = env.state
        actions.append(runaway_action(state.q, state.dq))
        *_, terminated, truncated, _ = env.step(actions[-1])
        ended = terminated or truncated
    env.restore(start)
    return env, actions
