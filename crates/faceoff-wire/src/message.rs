//! Messages from the evaluator to an agent, one JSON object per line. An agent plays *episodes* of a task (in air hockey
//! hit, defend or prepare), or a game, which is a sequence of *rallies*.

use crate::protocol::PROTOCOL_VERSION;
use faceoff_types::{AgentTask, Task};
use serde::Serialize;
use serde_json::value::RawValue;

/// A message to the agent.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum Message<'a> {
    /// Sent once, as the first message; answered by `ready`.
    Hello {
        /// [`PROTOCOL_VERSION`].
        protocol: u32,
        /// The task, or `tournament` for a game.
        task: Task,
        /// 1, or 2 for the second side of a game.
        agent_id: u32,
        /// The constants of the simulation, as the competition gives them.
        env: &'a RawValue,
    },
    /// Sent before each episode, and before each rally of a game; answered by `ready`.
    Reset {
        /// Number of the episode among those of the task in the evaluation, from 0; in a game, number of the rally.
        episode: u32,
    },
    /// Sent for each control step (20 ms); answered by `act`.
    Step {
        /// Index of the step within the episode or rally, from 0.
        step: u32,
        /// The observation.
        obs: &'a [f64],
    },
    /// Sent after each episode or rally; not answered.
    End {
        /// Number of the episode or rally, as in `reset`.
        episode: u32,
        /// Number of control steps played.
        steps: u32,
    },
    /// The last message; not answered.
    Bye,
}

impl<'a> Message<'a> {
    /// `hello` for the agent of a task that is played in episodes, or for one of the two agents of a game.
    #[must_use]
    pub fn hello(agent_task: AgentTask, env: &'a RawValue) -> Self {
        Self::Hello {
            protocol: PROTOCOL_VERSION,
            task: agent_task.name(),
            agent_id: agent_task.agent_id(),
            env,
        }
    }

    /// `step`, borrowing the observation.
    #[must_use]
    pub fn step(step: u32, obs: &'a [f64]) -> Self {
        Self::Step { step, obs }
    }

    /// Replaces the content of `buffer` by the message's line, including the newline, reusing its memory.
    /// Numbers are written with enough digits to be read back to the same bits.
    ///
    /// Numbers must be finite: JSON has no others, and an infinity would be read as `null`.
    pub fn write_line(&self, buffer: &mut Vec<u8>) {
        buffer.clear();
        serde_json::to_writer(&mut *buffer, self)
            .expect("writing plain data to memory cannot fail");
        buffer.push(b'\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(message: &Message<'_>) -> String {
        let mut buffer = b"previous line".to_vec();
        message.write_line(&mut buffer);
        String::from_utf8(buffer).unwrap()
    }

    #[test]
    fn messages_are_written_as_in_the_protocol() {
        assert_eq!(
            line(&Message::Reset { episode: 17 }),
            "{\"type\":\"reset\",\"episode\":17}\n"
        );
        assert_eq!(
            line(&Message::step(0, &[0.25, -1.0])),
            "{\"type\":\"step\",\"step\":0,\"obs\":[0.25,-1.0]}\n"
        );
        assert_eq!(
            line(&Message::End {
                episode: 17,
                steps: 133
            }),
            "{\"type\":\"end\",\"episode\":17,\"steps\":133}\n"
        );
        assert_eq!(line(&Message::Bye), "{\"type\":\"bye\"}\n");
    }

    #[test]
    fn observation_numbers_keep_their_bits() {
        let obs = [
            0.1 + 0.2,
            -0.0,
            f64::MIN_POSITIVE / 3.0,
            1e300,
            std::f64::consts::PI,
        ];
        let text = line(&Message::step(3, &obs));
        let read: serde_json::Value = serde_json::from_str(&text).unwrap();
        let obs_read: Vec<f64> = serde_json::from_value(read["obs"].clone()).unwrap();
        assert_eq!(
            obs_read.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
            obs.map(f64::to_bits)
        );
    }
}
