"""Talks to the agent as the evaluator does: python3 -m unittest. Add tests for your own agent here."""

import io
import json
import math
import random
import unittest

import agent
import protocol
from kinematics import forward

POSE = [0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0]
POSITION_LIMIT = [2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433]
VELOCITY_LIMIT = [math.radians(limit) for limit in (85, 85, 100, 75, 130, 135, 135)]
ENV = {
    "dt": 0.02,
    "table": {"length": 1.948, "width": 1.038, "goal_width": 0.25},
    "puck": {"radius": 0.03165},
    "mallet": {"radius": 0.04815},
    "robot": {
        "ee_desired_height": 0.1645,
        "base_frame": [[[1, 0, 0, -1.51], [0, 1, 0, 0], [0, 0, 1, -0.1], [0, 0, 0, 1]]],
        "joint_pos_limit": [[-limit for limit in POSITION_LIMIT], POSITION_LIMIT],
        "joint_vel_limit": [[-limit for limit in VELOCITY_LIMIT], VELOCITY_LIMIT],
    },
}
AGENT_CLASS = next(
    value
    for value in vars(agent).values()
    if isinstance(value, type) and issubclass(value, protocol.Agent) and value is not protocol.Agent
)


class AgentTest(unittest.TestCase):
    def test_agent_speaks_the_protocol(self) -> None:
        messages = [
            {"type": "hello", "protocol": 1, "task": "defend", "agent_id": 1, "env": ENV},
            {"type": "reset", "episode": 17},
            *({"type": "step", "step": k, "obs": [1.0, 0.1, 0, -1, 0, 0, *POSE, *[0.0] * 7]} for k in range(9)),
            {"type": "end", "episode": 17, "steps": 9},
            {"type": "bye"},
        ]
        output = io.BytesIO()
        protocol.run(AGENT_CLASS, [json.dumps(message).encode() for message in messages], output)
        kinds = [json.loads(line)["type"] for line in output.getvalue().splitlines()]
        self.assertEqual(kinds, ["ready", "ready", *["act"] * 9])

    def test_agent_keeps_its_limits(self) -> None:
        """The puck jumps, disappears and races, but the arm stays within its limits."""
        rng, policy = random.Random(2023), AGENT_CLASS("defend", 1, ENV)
        policy.reset()
        last, puck = POSE, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        for _ in range(1000):
            if rng.random() < 0.05:
                position = (rng.uniform(0.6, 2.4), rng.uniform(-0.48, 0.48), 0.0)
                puck = (*position, rng.gauss(0, 1.5), rng.gauss(0, 1.5), 0.0)
            pose, speeds = policy.act([*puck, *last, *[0.0] * 7])
            for before, q, dq, limit in zip(last, pose, speeds, VELOCITY_LIMIT):
                self.assertLess(abs(dq), 0.95 * limit)
                self.assertLess(abs(q - before), 0.95 * limit * 0.02)
            x, y, _ = forward(pose)
            self.assertGreater(x, 1.51 - 0.974 + 0.04815)
            self.assertLess(abs(y), 0.519 - 0.04815)
            last = pose


if __name__ == "__main__":
    unittest.main()
