"""What a policy that defends is told of a step: the puck's place and way, estimated, and the mallet's.

Of one world or of many at once, in the frame of the robot's own base, m and m/s.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from faceoff.kinematics import model

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

DT_S = 0.02
#: How far one observation moves the estimated velocity.
TRUST = 0.35
#: Share of its speed that the puck loses per second.
DRAG_PER_S = 0.5
#: Share of its speed across a rim that a bounce leaves.
BOUNCE = 0.75
#: A velocity that differs by more than this (m/s) from the expected one comes of a contact.
WAS_HIT_M_S = 0.7
#: Pucks that never come are this far off (s).
FAR_S = 1.5
RIM_M = model.TABLE_WIDTH_M / 2 - model.PUCK_RADIUS_M
LENGTH = 15


class Puck:
    """Estimates of pucks' places and velocities (n, 2), from observations that are noisy and sometimes missing."""

    def __init__(self, worlds: int) -> None:
        self.xy = np.zeros((worlds, 2))
        self.speed = np.zeros((worlds, 2))
        self.lost_s = np.zeros(worlds)
        self._seen = np.full((worlds, 2), np.nan)

    def restart(self, which: Bools) -> None:
        """These worlds begin an episode."""
        self._seen[which] = np.nan

    def observe(self, observations: Floats) -> None:
        """Takes in observations (n, 20)."""
        xy, speed = observations[:, :2], observations[:, 3:5]
        is_first = np.isnan(self._seen[:, 0])
        # A puck that is lost is told where it was, and at rest.
        is_lost = (xy == self._seen).all(axis=1) & (speed == 0.0).all(axis=1)
        there, expected = self.after(np.full(len(xy), DT_S))
        witnessed = 0.5 * (speed + (xy - self.xy) / DT_S)
        change = witnessed - expected
        was_hit = np.abs(change).sum(axis=1) > WAS_HIT_M_S
        trusted = expected + np.where(was_hit, 1.0, TRUST)[:, None] * change
        self.xy = np.where(is_lost[:, None], there, xy)
        self.speed = np.where(is_lost[:, None], expected, trusted)
        self.speed[is_first] = speed[is_first]
        self.lost_s = np.where(is_lost, self.lost_s + DT_S, 0.0)
        self._seen = xy.copy()

    def after(self, time_s: Floats) -> tuple[Floats, Floats]:
        """Places and velocities after some time (n,); bounces off the long rims count, all else does not."""
        slid = time_s * (1.0 - 0.5 * DRAG_PER_S * time_s)
        xy = self.xy + self.speed * slid[:, None]
        speed = self.speed * (1.0 - DRAG_PER_S * time_s)[:, None]
        for _ in range(3):
            beyond = np.abs(xy[:, 1]) > RIM_M
            rim = np.copysign(RIM_M, xy[:, 1])
            xy[:, 1] = np.where(beyond, rim - BOUNCE * (xy[:, 1] - rim), xy[:, 1])
            speed[:, 1] = np.where(beyond, -BOUNCE * speed[:, 1], speed[:, 1])
        return xy, speed


class View:
    """What policies see."""

    def __init__(self, worlds: int) -> None:
        self.puck = Puck(worlds)

    def restart(self, which: Bools) -> None:
        """These worlds begin an episode."""
        self.puck.restart(which)

    def look(self, observations: npt.NDArray[np.floating], mallet: Floats, mallet_speed: Floats) -> Floats:
        """From observations (n, 20) and where the mallets are commanded to be (n, 2) to (n, LENGTH)."""
        puck = self.puck
        puck.observe(np.asarray(observations, np.float64))
        away = puck.xy - mallet
        distance = np.linalg.norm(away, axis=1)
        coming = np.maximum(-puck.speed[:, 0], 1e-3)
        arrival_s = np.clip(away[:, 0] / coming, 0.0, FAR_S)
        there, _ = puck.after(arrival_s)
        return np.column_stack(
            [
                puck.xy,
                puck.speed,
                mallet,
                mallet_speed,
                away,
                distance,
                np.linalg.norm(puck.speed, axis=1),
                arrival_s,
                there[:, 1] - mallet[:, 1],
                np.minimum(puck.lost_s, 0.4),
            ]
        )
