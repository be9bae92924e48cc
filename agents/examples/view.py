"""Computes the features, the input of a defending policy: estimated motion of the puck, and motion of the mallet.

It does so for one world (simulated table) or many at once, in the robot's base frame, m and m/s.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from faceoff.kinematics import model

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

#: Control period (s).
DT_S = 0.02
#: Weight of one observation in the estimated velocity.
VELOCITY_GAIN = 0.35
#: Share of its speed that the puck loses per second.
DRAG_PER_S = 0.5
#: Coefficient of restitution of a bounce off a rim.
RIM_RESTITUTION = 0.75
#: A larger difference (m/s) of measured and predicted velocity implies a contact.
CONTACT_CHANGE_M_S = 0.7
#: Upper bound of the feature "time to arrival" (s); pucks that do not approach have it, too.
MAX_ARRIVAL_S = 1.5
#: Largest |y| of a puck's centre, at a long rim (m).
PUCK_Y_MAX_M = model.TABLE_WIDTH_M / 2 - model.PUCK_RADIUS_M
#: Longest time for which tracking of the puck is lost (s).
MAX_LOST_S = 0.4
#: Length of a feature vector.
FEATURE_COUNT = 15


class Puck:
    """Estimated positions and velocities (n, 2) of pucks, from noisy, sometimes missing observations."""

    def __init__(self, worlds: int) -> None:
        self.xy = np.zeros((worlds, 2))
        self.speed = np.zeros((worlds, 2))
        #: Time since tracking of the puck was lost (s).
        self.lost_s = np.zeros(worlds)
        self._last_xy = np.full((worlds, 2), np.nan)

    def restart(self, mask: Bools) -> None:
        """Begins an episode in the worlds of the mask (worlds,)."""
        self._last_xy[mask] = np.nan

    def observe(self, observations: Floats) -> None:
        """Updates the estimates with observations (n, 20)."""
        xy, speed = observations[:, :2], observations[:, 3:5]
        is_first = np.isnan(self._last_xy[:, 0])
        # A lost puck is reported at its last position, at rest.
        is_lost = (xy == self._last_xy).all(axis=1) & (speed == 0.0).all(axis=1)
        predicted_xy, predicted_speed = self.predict(np.full(len(xy), DT_S))
        measured = 0.5 * (speed + (xy - self.xy) / DT_S)
        change = measured - predicted_speed
        was_hit = np.abs(change).sum(axis=1) > CONTACT_CHANGE_M_S
        filtered = predicted_speed + np.where(was_hit, 1.0, VELOCITY_GAIN)[:, None] * change
        self.xy = np.where(is_lost[:, None], predicted_xy, xy)
        self.speed = np.where(is_lost[:, None], predicted_speed, filtered)
        self.speed[is_first] = speed[is_first]
        self.lost_s = np.where(is_lost, self.lost_s + DT_S, 0.0)
        self._last_xy = xy.copy()

    def predict(self, time_s: Floats) -> tuple[Floats, Floats]:
        """Positions and velocities after times (n,), s; only bounces off the long rims are modelled."""
        slide_s = time_s * (1.0 - 0.5 * DRAG_PER_S * time_s)
        xy = self.xy + self.speed * slide_s[:, None]
        speed = self.speed * (1.0 - DRAG_PER_S * time_s)[:, None]
        for _ in range(3):
            is_beyond = np.abs(xy[:, 1]) > PUCK_Y_MAX_M
            rim = np.copysign(PUCK_Y_MAX_M, xy[:, 1])
            xy[:, 1] = np.where(is_beyond, rim - RIM_RESTITUTION * (xy[:, 1] - rim), xy[:, 1])
            speed[:, 1] = np.where(is_beyond, -RIM_RESTITUTION * speed[:, 1], speed[:, 1])
        return xy, speed


class View:
    """Computes the feature vectors of policies."""

    def __init__(self, worlds: int) -> None:
        self.puck = Puck(worlds)

    def restart(self, mask: Bools) -> None:
        """Begins an episode in the worlds of the mask (worlds,)."""
        self.puck.restart(mask)

    def update(self, observations: npt.NDArray[np.floating], mallet: Floats, mallet_speed: Floats) -> Floats:
        """Features (n, FEATURE_COUNT) from observations (n, 20) and commanded mallet positions and velocities (n, 2)."""
        puck = self.puck
        puck.observe(np.asarray(observations, np.float64))
        offset = puck.xy - mallet
        distance = np.linalg.norm(offset, axis=1)
        approach_speed = np.maximum(-puck.speed[:, 0], 1e-3)
        arrival_s = np.clip(offset[:, 0] / approach_speed, 0.0, MAX_ARRIVAL_S)
        arrival_xy, _ = puck.predict(arrival_s)
        return np.column_stack(
            [
                puck.xy,
                puck.speed,
                mallet,
                mallet_speed,
                offset,
                distance,
                np.linalg.norm(puck.speed, axis=1),
                arrival_s,
                arrival_xy[:, 1] - mallet[:, 1],
                np.minimum(puck.lost_s, MAX_LOST_S),
            ]
        )
