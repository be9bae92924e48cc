"""Commands that several tests give."""

import numpy as np

from faceoff.gym import AirHockeyEnv


def pump(q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """(420,) a whole trajectory, raw, that pushes every joint on in the direction in which it moves."""
    sign = np.where(dq >= 0.0, 1.0, -1.0)
    return np.tile(np.concatenate([q + 3.0 * sign, 1e4 * sign, 1e4 * sign]), 20)


def diverging() -> tuple[AirHockeyEnv, list[np.ndarray]]:
    """An environment at the start of episode 0 of ``prepare``, seed 0, and actions by which its world diverges."""
    env = AirHockeyEnv("prepare", interpolation=None, action_mode="raw")
    env.reset(seed=0)
    start = env.save()
    actions, ended = [], False
    while not ended:
        state = env.state
        actions.append(pump(state.q, state.dq))
        *_, terminated, truncated, _ = env.step(actions[-1])
        ended = terminated or truncated
    env.restore(start)
    return env, actions
