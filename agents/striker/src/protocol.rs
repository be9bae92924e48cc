//! The agent's side of the protocol: one JSON object per line on standard input and output.

use std::io::{BufRead, Write};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use crate::{Action, Env, Policy, Task};

/// The protocol version that this agent speaks.
const VERSION: u32 = 1;
/// Cubic interpolation: positions and velocities.
const INTERPOLATION: i64 = 3;

/// A message from the evaluator.
#[derive(Debug, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum Message {
    Hello {
        protocol: u32,
        task: Task,
        env: Box<Env>,
    },
    Reset {
        episode: u64,
    },
    Step {
        step: u64,
        obs: Vec<f64>,
    },
    End {},
    Bye {},
}

/// An answer to the evaluator.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum Answer {
    Ready {
        #[serde(flatten)]
        ready: Ready,
    },
    Act {
        step: u64,
        action: Action,
    },
}

#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Ready {
    Hello {
        protocol: u32,
        interpolation: i64,
        name: &'static str,
        version: &'static str,
    },
    Reset {
        episode: u64,
    },
}

/// Lets the policy that `make` makes answer messages from `input` on `output` until `bye` or the end of the
/// input. `name` and `version` are what the program calls itself.
///
/// # Errors
/// If a message is not understood or the pipe breaks.
pub fn serve<P: Policy>(
    [name, version]: [&'static str; 2],
    make: impl Fn(Task, &Env) -> P,
    input: impl BufRead,
    mut output: impl Write,
) -> anyhow::Result<()> {
    let mut agent: Option<P> = None;
    for line in input.lines() {
        let line = line.context("read a message")?;
        let message = serde_json::from_str(&line)
            .with_context(|| format!("understand the message {line:.200}"))?;
        let answer = match message {
            Message::Hello {
                protocol,
                task,
                env,
            } => {
                if protocol != VERSION {
                    bail!("expected protocol {VERSION}, the evaluator speaks {protocol}");
                }
                agent = Some(make(task, &env));
                let ready = Ready::Hello {
                    protocol: VERSION,
                    interpolation: INTERPOLATION,
                    name,
                    version,
                };
                Some(Answer::Ready { ready })
            }
            Message::Reset { episode } => {
                agent
                    .as_mut()
                    .context("expected hello before reset")?
                    .reset();
                Some(Answer::Ready {
                    ready: Ready::Reset { episode },
                })
            }
            Message::Step { step, obs } => {
                let action = agent
                    .as_mut()
                    .context("expected hello before step")?
                    .act(&obs)?;
                Some(Answer::Act { step, action })
            }
            Message::End {} => None,
            Message::Bye {} => return Ok(()),
        };
        if let Some(answer) = answer {
            let mut line = serde_json::to_vec(&answer).context("encode the answer")?;
            line.push(b'\n');
            output
                .write_all(&line)
                .and_then(|()| output.flush())
                .context("write the answer")?;
        }
    }
    Ok(())
}
