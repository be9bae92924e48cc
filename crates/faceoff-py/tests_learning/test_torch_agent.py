"""An agent with a network of PyTorch plays in the sandbox."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

AGENT = """
import torch
import torch.distributed
from faceoff.agent import Agent, run


class Hold(Agent):
    def start(self):
        assert torch.get_num_threads() == 1, torch.get_num_threads()
        # A group of one process, over a socket of the agent's own network.
        torch.distributed.init_process_group("gloo", init_method="tcp://127.0.0.1:29500", rank=0, world_size=1)
        sums = torch.ones(3)
        torch.distributed.all_reduce(sums)
        self.network = torch.nn.Sequential(torch.nn.Linear(7, 64), torch.nn.ReLU(), torch.nn.Linear(64, 7))
        print("torch", torch.__version__, sums.tolist())

    def reset(self):
        self.pose = None

    def act(self, observation):
        if self.pose is None:
            self.pose = self.joint_positions(observation)
        with torch.inference_mode():
            self.network(torch.tensor(self.pose, dtype=torch.float32))
        return [self.pose, [0.0] * 7]


run(Hold)
"""


def test_agent_with_a_network_plays(tmp_path: Path) -> None:
    bundle = tmp_path / "agent"
    bundle.mkdir()
    (bundle / "agent.py").write_text(AGENT)
    (bundle / "agent.toml").write_text('name = "torch"\ncommand = ["python3", "agent.py"]\nruntime = "torch"\ninterpolation = 3\n')
    config = tmp_path / "faceoff.toml"
    config.write_text(f'[runtimes.torch]\nfolder = "{sys.prefix}"\n')
    program = Path(os.environ["TARGET_DIR"], "release/faceoff")
    command = [program, "eval", bundle, "--task", "defend", "--episodes", "20", "--json", "--config", config, "--out", tmp_path / "out"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr + done.stdout
    answer = json.loads(done.stdout)
    assert answer["faults"] == []
    assert answer["result"]["tasks"]["defend"]["episodes"] == 20
