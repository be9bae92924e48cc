"""Games of two robots: for PettingZoo, for self-play against a pool of opponents, and many at once.

- :class:`AirHockeyGame`: a PettingZoo environment of one game.
- :class:`SelfPlayEnv`: one side of it, for Gymnasium.
- :class:`AirHockeyGameVectorEnv`: many games, in which the learner plays both sides.
- :class:`SelfPlayVectorEnv`: many games against a pool of opponents.

A game consists of rallies: each lasts until a goal, a foul or another reason to put the puck down again.
"""

from __future__ import annotations

from faceoff._distribution import install_command
from faceoff.errors import MissingError

try:
    import gymnasium as _gymnasium
    import pettingzoo as _pettingzoo
except ImportError as error:  # pragma: no cover - depends on what is installed
    raise MissingError(f"faceoff.game needs gymnasium and pettingzoo: {install_command('games')}") from error

from faceoff.game.parallel import AirHockeyGame
from faceoff.game.self_play import SelfPlayEnv
from faceoff.game.transition import AGENTS, GAME_STEPS, GameReward, GameTransition, default_reward
from faceoff.game.vector import AirHockeyGameVectorEnv, SelfPlayVectorEnv

__all__ = [
    "AGENTS",
    "GAME_STEPS",
    "AirHockeyGame",
    "AirHockeyGameVectorEnv",
    "GameReward",
    "GameTransition",
    "SelfPlayEnv",
    "SelfPlayVectorEnv",
    "default_reward",
]
