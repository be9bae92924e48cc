"""The evaluator's side of an agent: one JSON object per line, in and out.

Copy this file into your own bundle; only the standard library is needed. A policy is any class with

    __init__(self, task, agent_id, env)   once; task is "hit", "defend", "prepare" or "tournament"
    reset(self)                           before each episode, and before each rally of a game
    act(self, obs)                        each control step: the list of numbers seen -> the action

`env` describes table, robot, limits and where to find what in `obs`; its keys are in the protocol's
documentation. Start-up and reset are not timed; an answer of `act` counts as late after 20 ms.
"""

import json
import sys

PROTOCOL = 1


def play(policy_class, interpolation):
    """Speaks with the evaluator until it says goodbye or goes away."""
    requests, answers = sys.stdin.buffer, sys.stdout.buffer
    # Standard output belongs to the protocol: a stray print() goes to the log instead.
    sys.stdout = sys.stderr
    policy = None
    for line in requests:
        message = json.loads(line)
        kind = message["type"]
        if kind == "step":
            answer = {"type": "act", "step": message["step"], "action": policy.act(message["obs"])}
        elif kind == "reset":
            policy.reset()
            answer = {"type": "ready", "episode": message["episode"]}
        elif kind == "hello":
            if message["protocol"] != PROTOCOL:
                sys.exit(f"this agent speaks protocol {PROTOCOL}, not {message['protocol']}")
            policy = policy_class(message["task"], message["agent_id"], message["env"])
            answer = {"type": "ready", "protocol": PROTOCOL, "interpolation": interpolation}
        elif kind == "end":
            continue  # the episode is over; no answer is expected
        elif kind == "bye":
            return
        else:
            sys.exit(f"unknown message {kind!r}")
        # NaN and infinity would be refused; here the log shows where they came from.
        answers.write(json.dumps(answer, allow_nan=False).encode() + b"\n")
        answers.flush()
