"""An agent that keeps the arm where it is, or swings it by SWING rad. With GOOD_EPISODES, it exits in the first episode
after that many. With MISCHIEF, it misbehaves in a way that must not harm the opponent of a game."""
import json
import math
import os
import sys
import time

good_episodes = int(os.environ.get("GOOD_EPISODES", 1 << 30))
swing = float(os.environ.get("SWING", 0))
mischief = os.environ.get("MISCHIEF")
started_episodes = 0
print("an agent's log", file=sys.stderr, flush=True)


def answer(message):
    print(json.dumps(message), flush=True)


for line in sys.stdin:
    message = json.loads(line)
    kind = message["type"]
    if kind == "hello":
        env = message["env"]
        answer({"type": "ready", "protocol": 1, "interpolation": 3})
    elif kind == "reset":
        started_episodes += 1
        start_position = None
        if mischief == "crashes":
            os._exit(4)
        answer({"type": "ready", "episode": message["episode"]})
    elif kind == "step":
        if started_episodes > good_episodes:
            sys.exit(3)
        step = message["step"]
        start_position = start_position or [message["obs"][i] for i in env["joint_pos_ids"]]
        position = [start_position[0] + swing * math.sin(step / 10), *start_position[1:]]
        action = [position, [0.0] * 7]
        if mischief == "silent":
            continue
        if mischief == "floods":
            print("x" * 100000, flush=True)
        if mischief == "slow":
            time.sleep(0.06)
        if mischief == "at the bound":
            action = [[1e4 if step % 2 else -1e4] * 7] * 2
        answer({"type": "act", "step": step, "action": action})
    elif kind == "bye":
        break
