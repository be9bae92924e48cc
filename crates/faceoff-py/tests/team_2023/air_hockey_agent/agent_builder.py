"""A team's agent, written as for the challenge of 2023: nothing here knows of this server."""

import numpy as np

from air_hockey_agent.motion import clip_to_table
from air_hockey_challenge.constraints import *
from air_hockey_challenge.framework import AgentBase, AirHockeyChallengeWrapper
from air_hockey_challenge.utils import world_to_robot
from air_hockey_challenge.utils.kinematics import forward_kinematics, inverse_kinematics, jacobian


def build_agent(env_info, **kwargs):
    if "hit" in env_info["env_name"] or env_info["env_name"] == "tournament":
        return Follower(env_info, distance=0.2, **kwargs)
    return Follower(env_info, **kwargs)


class Follower(AgentBase):
    """Keeps the mallet in front of its own goal, at the puck's y."""

    def __init__(self, env_info, agent_id=1, distance=0.15, gain=1.0, **kwargs):
        super().__init__(env_info, agent_id, **kwargs)
        self.gain = gain
        self.dt = env_info["dt"]
        self.height = env_info["robot"]["ee_desired_height"]
        goal_line = np.array([-env_info["table"]["length"] / 2, 0.0, 0.0])
        self.x = world_to_robot(env_info["robot"]["base_frame"][0], goal_line)[0][0] + distance
        self.constraints = env_info["constraints"]

    def reset(self):
        self.q = None

    def draw_action(self, observation):
        if self.q is None:
            self.q = self.get_joint_pos(observation)
        puck, _ = self.get_puck_state(observation)
        target = np.array([self.x, clip_to_table(puck[1]), self.height])
        here, _ = forward_kinematics(self.robot_model, self.robot_data, self.q)
        velocity = self.gain * (target - here)
        velocity *= min(1.0, 0.5 / max(np.linalg.norm(velocity), 1e-9))
        rates = np.linalg.pinv(jacobian(self.robot_model, self.robot_data, self.q)[:3]) @ velocity
        success, q = inverse_kinematics(
            self.robot_model, self.robot_data, here + velocity * self.dt, initial_q=self.q + rates * self.dt
        )
        worst = max(np.max(values) for values in self.constraints.fun(q, rates).values())
        if success and worst < 0.0:
            self.q = q
        else:
            rates = np.zeros(7)
        return np.vstack([self.q, rates])
