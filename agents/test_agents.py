"""Tests the Python reference agents in messages of the evaluator's protocol: python3 -m unittest.

Other tests run the agents in the simulator.
"""

import json
import math
import random
import subprocess
import sys
import tomllib
import unittest
from pathlib import Path

AGENTS = Path(__file__).parent
# Seconds for an agent to exit, more than on the slowest machine.
EXIT_TIMEOUT_S = 600
DT_S = 0.02  # control period
TABLE_LENGTH_M, TABLE_WIDTH_M = 1.948, 1.038
PUCK_RADIUS_M, MALLET_RADIUS_M = 0.03165, 0.04815
MALLET_HEIGHT_M = 0.1645
BASE_DISTANCE_M = 1.51  # from a robot's base to the table's centre
# The joint angles at which every episode starts, rad.
START_POSE = [0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0]
# Limits of the joints, rad and rad/s.
POS_LIMIT = [2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433]
VEL_LIMIT = [math.radians(limit) for limit in (85, 85, 100, 75, 130, 135, 135)]
ENV = {
    "dt": DT_S,
    "table": {"length": TABLE_LENGTH_M, "width": TABLE_WIDTH_M, "goal_width": 0.25},
    "puck": {"radius": PUCK_RADIUS_M},
    "mallet": {"radius": MALLET_RADIUS_M},
    "joint_pos_ids": list(range(6, 13)),
    "joint_vel_ids": list(range(13, 20)),
    "robot": {
        "n_joints": 7,
        "ee_desired_height": MALLET_HEIGHT_M,
        "base_frame": [[1, 0, 0, -BASE_DISTANCE_M, 0, 1, 0, 0, 0, 0, 1, -0.1, 0, 0, 0, 1]],
        "joint_pos_limit": [[-limit for limit in POS_LIMIT], POS_LIMIT],
        "joint_vel_limit": [[-limit for limit in VEL_LIMIT], VEL_LIMIT],
    },
}


class Agent:
    """A running agent, started as its `agent.toml` says."""

    def __init__(self, name, task="hit"):
        folder = AGENTS / name
        self.manifest = tomllib.loads((folder / "agent.toml").read_text())
        self.process = subprocess.Popen(
            self.manifest["command"], cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        hello = {"type": "hello", "protocol": 1, "task": task, "agent_id": 1, "env": ENV}
        self.ready = self.ask(hello)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()

    def send(self, message):
        self.process.stdin.write(json.dumps(message).encode() + b"\n")
        self.process.stdin.flush()

    def ask(self, message):
        """Sends a message and returns the answer."""
        self.send(message)
        return json.loads(self.process.stdout.readline())

    def reset(self, episode):
        return self.ask({"type": "reset", "episode": episode})

    def step(self, step, pose, has_opponent=True, puck=(1.0, 0.1, 0.0, 0.0, 0.0, 0.0)):
        obs = [*puck, *pose, *[0.0] * 7, *[2.37, 0.0, MALLET_HEIGHT_M] * has_opponent]
        answer = self.ask({"type": "step", "step": step, "obs": obs})
        assert (answer["type"], answer["step"]) == ("act", step), answer
        return answer["action"]


class AllAgents(unittest.TestCase):
    names = ["hold", "reckless", "starter"]

    def test_agents_follow_the_protocol_from_hello_to_bye(self):
        for name in self.names:
            for task in ("hit", "defend", "prepare", "tournament"):
                with self.subTest(name, task=task), Agent(name, task) as agent:
                    interpolation = agent.manifest["interpolation"]
                    self.assertEqual(
                        agent.ready, {"type": "ready", "protocol": 1, "interpolation": interpolation}
                    )
                    for episode in (17, 3):
                        self.assertEqual(agent.reset(episode), {"type": "ready", "episode": episode})
                        for step in range(500):
                            action = agent.step(step, START_POSE, task in ("hit", "tournament"))
                            self.assertEqual([len(row) for row in action], [7, 7])
                            self.assertTrue(all(math.isfinite(x) for row in action for x in row))
                        agent.send({"type": "end", "episode": episode, "steps": 500})
                    agent.send({"type": "bye"})
                    self.assertEqual(agent.process.wait(timeout=EXIT_TIMEOUT_S), 0)

    def test_agents_end_at_the_end_of_input(self):
        for name in self.names:
            with self.subTest(name), Agent(name) as agent:
                agent.process.stdin.close()
                self.assertEqual(agent.process.wait(timeout=EXIT_TIMEOUT_S), 0)
                agent.process.stdin = None

    def test_manifests_and_protocol_copies_are_consistent(self):
        protocol = (AGENTS.parent / "crates/faceoff-py/python/faceoff/agent.py").read_bytes()
        for name in self.names:
            self.assertEqual(tomllib.loads((AGENTS / name / "agent.toml").read_text())["name"], name)
            self.assertEqual((AGENTS / name / "protocol.py").read_bytes(), protocol)


class Hold(unittest.TestCase):
    def test_hold_keeps_the_first_pose_of_each_episode(self):
        with Agent("hold") as agent:
            for episode, offset in enumerate((0.0, 0.05)):
                agent.reset(episode)
                first = [q + offset for q in START_POSE]
                self.assertEqual(agent.step(0, first), [first, [0.0] * 7])
                sagged = [q + offset + 0.01 for q in START_POSE]
                self.assertEqual(agent.step(1, sagged), [first, [0.0] * 7])


class Reckless(unittest.TestCase):
    def test_reckless_moves_joints_to_both_limits_at_full_speed(self):
        with Agent("reckless") as agent:
            agent.reset(0)
            actions = [agent.step(step, START_POSE) for step in range(500)]
        for joint in range(7):
            positions = [pose[joint] for pose, _ in actions]
            speeds = {abs(velocity[joint]) for _, velocity in actions}
            self.assertEqual(speeds, {VEL_LIMIT[joint]}, "beyond the 95 % that the rules allow")
            self.assertGreater(max(positions), 0.99 * POS_LIMIT[joint])
            self.assertLess(min(positions), -0.99 * POS_LIMIT[joint])
            self.assertLessEqual(max(map(abs, positions)), POS_LIMIT[joint])


class Starter(unittest.TestCase):
    """The starter agent's geometry, limits and strikes."""

    @classmethod
    def setUpClass(cls):
        sys.path.insert(0, str(AGENTS / "starter"))
        import arm

        cls.arm = arm

    def test_joint_angles_put_the_mallet_at_the_point(self):
        for x in (0.6, 0.65, 0.8, 1.0, 1.2):
            for y in (-0.45, -0.2, 0.0, 0.3):
                q = self.arm.joints_at(x, y, MALLET_HEIGHT_M)
                reached = self.arm.mallet_at(q)
                self.assertAlmostEqual(reached[0], x, 9)
                self.assertAlmostEqual(reached[1], y, 9)
                self.assertTrue(all(abs(a) < 0.95 * limit for a, limit in zip(q, POS_LIMIT)), (x, y, q))
        for angle, start in zip(self.arm.joints_at(0.65, 0.0, MALLET_HEIGHT_M), START_POSE):
            self.assertAlmostEqual(angle, start, 3)

    def test_starter_keeps_its_limits_under_any_puck(self):
        """Pucks at random positions that jump, vanish and move fast."""
        rng = random.Random(2023)
        for task in ("hit", "defend", "prepare", "tournament"):
            with self.subTest(task), Agent("starter", task) as agent:
                agent.reset(0)
                last_pose, puck = START_POSE, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
                for step in range(3000):
                    if rng.random() < 0.05:
                        puck_pose = (rng.uniform(0.5, 2.5), rng.uniform(-0.52, 0.52), 0.0)
                        puck = (*puck_pose, rng.gauss(0, 1.5), rng.gauss(0, 1.5), rng.gauss(0, 10))
                    if rng.random() < 0.03:
                        puck = (*puck[:3], 0.0, 0.0, 0.0)
                    pose, speeds = agent.step(step, last_pose, task in ("hit", "tournament"), puck)
                    for last_angle, angle, speed, limit in zip(last_pose, pose, speeds, VEL_LIMIT):
                        self.assertLess(abs(speed), 0.95 * limit)
                        self.assertLess(abs(angle - last_angle), 0.95 * limit * DT_S)
                    x, y = self.arm.mallet_at(pose)
                    self.assertGreater(x, BASE_DISTANCE_M - TABLE_LENGTH_M / 2 + MALLET_RADIUS_M)
                    self.assertLess(abs(y), TABLE_WIDTH_M / 2 - MALLET_RADIUS_M)
                    last_pose = pose

    def test_starter_strikes_a_puck_in_front_of_it(self):
        with Agent("starter", "tournament") as agent:
            agent.reset(0)
            pose, positions = START_POSE, []
            for step in range(250):
                pose, _ = agent.step(step, pose, puck=(1.0, 0.2, 0.0, 0.0, 0.0, 0.0))
                positions.append(self.arm.mallet_at(pose))
            nearest = min(math.dist(position, (1.0, 0.2)) for position in positions)
            self.assertLess(nearest, PUCK_RADIUS_M + MALLET_RADIUS_M, "the mallet must touch the puck")


if __name__ == "__main__":
    unittest.main()
