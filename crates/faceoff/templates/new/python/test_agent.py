"""Talks to the agent as the evaluator does: python3 -m unittest. Add tests for your own agent here."""

import io
import json
import math
import random
import unittest

import agent
import protocol
from kinematics import forward

INITIAL_POSE = [0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0]  # joint positions at the start of an episode, rad
POSITION_LIMIT = [2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433]  # rad
VELOCITY_LIMIT = [math.radians(limit) for limit in (85, 85, 100, 75, 130, 135, 135)]  # rad/s
EPISODE = 17  # any number
CONTROL_STEP = 0.02  # s
# The part of `env` of the message `hello` that the agent uses: metres, radians, seconds.
ENV = {
    "dt": CONTROL_STEP,
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
            {"type": "reset", "episode": EPISODE},
            *(
                # An observation is the puck (x, y, yaw and their velocities), the joint positions and velocities.
                {"type": "step", "step": step, "obs": [1.0, 0.1, 0, -1, 0, 0, *INITIAL_POSE, *[0.0] * 7]}
                for step in range(9)
            ),
            {"type": "end", "episode": EPISODE, "steps": 9},
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
        last_pose, puck = INITIAL_POSE, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        for _ in range(1000):
            if rng.random() < 0.05:
                puck_position = (rng.uniform(0.6, 2.4), rng.uniform(-0.48, 0.48), 0.0)
                puck = (*puck_position, rng.gauss(0, 1.5), rng.gauss(0, 1.5), 0.0)
            pose, speeds = policy.act([*puck, *last_pose, *[0.0] * 7])
            # The rules allow 95 % of a joint's speed limit.
            for last_position, position, speed, limit in zip(last_pose, pose, speeds, VELOCITY_LIMIT):
                self.assertLess(abs(speed), 0.95 * limit)
                self.assertLess(abs(position - last_position), 0.95 * limit * CONTROL_STEP)
            # The whole mallet stays on its own side of the table: the base is 1.51 m from the centre of the table.
            x, y, _ = forward(pose)
            self.assertGreater(x, 1.51 - 0.974 + 0.04815)
            self.assertLess(abs(y), 0.519 - 0.04815)
            last_pose = pose


if __name__ == "__main__":
    unittest.main()
