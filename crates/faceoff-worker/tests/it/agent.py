"""Keeps the arm where it is. With FAULTY_FROM, the episodes from that one on end by its exit."""
import json
import os
import sys

faulty_from = int(os.environ.get("FAULTY_FROM", 1 << 30))
episode = 0
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
        episode = message["episode"]
        held = None
        answer({"type": "ready", "episode": episode})
    elif kind == "step":
        if episode >= faulty_from:
            sys.exit(3)
        held = held or [message["obs"][i] for i in env["joint_pos_ids"]]
        answer({"type": "act", "step": message["step"], "action": [held, [0.0] * 7]})
    elif kind == "bye":
        break
