"""Speaks the protocol with the Python reference agents, as the evaluator does: python3 -m unittest.

What they do to the robot is tested end to end, with the simulator.
"""

import json
import math
import subprocess
import tomllib
import unittest
from pathlib import Path

AGENTS = Path(__file__).parent
# Seconds for an agent to end; only a dead machine needs more.
PATIENCE = 600
POSE = [0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0]
POS_LIMIT = [2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433]
VEL_LIMIT = [math.radians(limit) for limit in (85, 85, 100, 75, 130, 135, 135)]
ENV = {
    "dt": 0.02,
    "joint_pos_ids": list(range(6, 13)),
    "joint_vel_ids": list(range(13, 20)),
    "robot": {
        "n_joints": 7,
        "joint_pos_limit": [[-limit for limit in POS_LIMIT], POS_LIMIT],
        "joint_vel_limit": [[-limit for limit in VEL_LIMIT], VEL_LIMIT],
    },
}


class Agent:
    """A bundle's program, started by its manifest."""

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
        self.send(message)
        return json.loads(self.process.stdout.readline())

    def reset(self, episode):
        return self.ask({"type": "reset", "episode": episode})

    def step(self, step, pose, opponent=True):
        obs = [-0.5, 0.1, 0.0, 0.0, 0.0, 0.0, *pose, *[0.0] * 7, *[0.65, 0.0, 0.1645] * opponent]
        answer = self.ask({"type": "step", "step": step, "obs": obs})
        assert (answer["type"], answer["step"]) == ("act", step), answer
        return answer["action"]


class EveryAgent(unittest.TestCase):
    names = ["hold", "reckless"]

    def test_speaks_the_protocol_from_hello_to_bye(self):
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
                            action = agent.step(step, POSE, task in ("hit", "tournament"))
                            self.assertEqual([len(row) for row in action], [7, 7])
                            self.assertTrue(all(math.isfinite(x) for row in action for x in row))
                        agent.send({"type": "end", "episode": episode, "steps": 500})
                    agent.send({"type": "bye"})
                    self.assertEqual(agent.process.wait(timeout=PATIENCE), 0)

    def test_ends_when_the_evaluator_goes_away(self):
        for name in self.names:
            with self.subTest(name), Agent(name) as agent:
                agent.process.stdin.close()
                self.assertEqual(agent.process.wait(timeout=PATIENCE), 0)
                agent.process.stdin = None

    def test_manifest_and_protocol_are_those_of_the_folder(self):
        shell = (AGENTS / "hold" / "protocol.py").read_text()
        for name in self.names:
            self.assertEqual(tomllib.loads((AGENTS / name / "agent.toml").read_text())["name"], name)
            self.assertEqual((AGENTS / name / "protocol.py").read_text(), shell)


class Hold(unittest.TestCase):
    def test_keeps_the_first_pose_of_each_episode_however_the_arm_sags(self):
        with Agent("hold") as agent:
            for episode, offset in enumerate((0.0, 0.05)):
                agent.reset(episode)
                first = [q + offset for q in POSE]
                self.assertEqual(agent.step(0, first), [first, [0.0] * 7])
                sagged = [q + offset + 0.01 for q in POSE]
                self.assertEqual(agent.step(1, sagged), [first, [0.0] * 7])


class Reckless(unittest.TestCase):
    def test_runs_to_both_ends_of_every_range_at_full_speed(self):
        with Agent("reckless") as agent:
            agent.reset(0)
            actions = [agent.step(step, POSE) for step in range(500)]
        for joint in range(7):
            positions = [pose[joint] for pose, _ in actions]
            speeds = {abs(velocity[joint]) for _, velocity in actions}
            self.assertEqual(speeds, {VEL_LIMIT[joint]}, "beyond the 95 % that the rules allow")
            self.assertGreater(max(positions), 0.99 * POS_LIMIT[joint])
            self.assertLess(min(positions), -0.99 * POS_LIMIT[joint])
            self.assertLessEqual(max(map(abs, positions)), POS_LIMIT[joint])


if __name__ == "__main__":
    unittest.main()
