//! The loop of an agent: it reads the evaluator's messages (`hello`, `reset`, `step`, `end`, `bye`), one JSON object per line, and
//! writes the answers `ready` and `act`.

use crate::{
    action::{Action, Interpolation},
    env::Env,
    observation::Observation,
};
use serde::{Deserialize, Serialize};
use std::{
    error::Error,
    io::{self, BufRead, Write},
    process::ExitCode,
};

/// The protocol version of this crate.
const VERSION: u32 = 1;

/// Error of an agent's policy.
pub type Failure = Box<dyn Error + Send + Sync>;

/// A policy: computes an action for each observation.
pub trait Agent {
    /// Called before each episode, and before each rally of a game. It may take at most 10 s.
    fn reset(&mut self);

    /// The action for an observation. Episodes with answers that take 20 ms or longer can get penalty points.
    ///
    /// # Errors
    /// Any error is logged and ends the program, which is an agent fault.
    fn act(&mut self, observation: &Observation) -> Result<Action, Failure>;
}

/// The agent's description, which it sends in `ready`, the answer to `hello`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct AgentInfo {
    /// Name of the program.
    pub name: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// What the numbers of its actions are.
    pub interpolation: Interpolation,
}

/// The task of a session (one run of the agent's program).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Task {
    /// Score a goal against an opponent that swings its mallet.
    Hit,
    /// Stop an incoming puck.
    Defend,
    /// Move the puck from the rim into a good hitting position.
    Prepare,
    /// Play a whole game.
    Tournament,
}

/// The first message of the evaluator.
#[derive(Debug, Clone, Deserialize)]
pub struct Hello {
    protocol: u32,
    /// The task of this session.
    pub task: Task,
    /// 1 or 2: which robot of the table is the agent's own.
    #[serde(default = "first_agent_id")]
    pub agent_id: u32,
    /// Table, robot and limits.
    pub env: Box<Env>,
}

const fn first_agent_id() -> u32 {
    1
}

#[derive(Debug, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum Message {
    Hello(Hello),
    Reset {
        episode: u64,
    },
    Step {
        step: u64,
        obs: Observation,
    },
    /// The episode or rally has ended. It gets no answer.
    End {},
    /// The session has ended.
    Bye {},
}

#[derive(Debug, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum Answer {
    Ready(Ready),
    Act {
        step: u64,
        action: Action,
    },
    /// Not a valid answer: the evaluator counts it as an agent fault and shows the line to the team.
    Error {
        error: String,
    },
}

/// `ready` as the answer to `hello` or to `reset`.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Ready {
    Hello {
        protocol: u32,
        #[serde(flatten)]
        info: AgentInfo,
    },
    Reset {
        episode: u64,
    },
}

/// Reason why a conversation ended before `bye`.
#[derive(Debug, thiserror::Error)]
pub enum ConversationError {
    /// A line that is not a message of the protocol.
    #[error("expected a message of the protocol, got {line:.200}")]
    InvalidMessage {
        /// The received line.
        line: String,
        /// The cause from the JSON parser.
        source: serde_json::Error,
    },
    /// The evaluator uses another version.
    #[error("expected protocol {VERSION}, got {0} from the evaluator")]
    UnsupportedProtocol(u32),
    /// A message before `hello`.
    #[error("expected hello before {0}")]
    HelloMissing(&'static str),
    /// The agent's policy returned an error.
    #[error("step {step}: {failure}")]
    ActFailed {
        /// The control step, from 0.
        step: u64,
        /// The error of the policy.
        failure: Failure,
    },
    /// An action that the evaluator would refuse.
    #[error("step {step}: {reason}")]
    InvalidAction {
        /// The control step, from 0.
        step: u64,
        /// Why the evaluator would refuse it.
        reason: String,
    },
    /// Reading from or writing to the evaluator failed.
    #[error("expected a connection to the evaluator")]
    Io(#[from] io::Error),
}

/// Creates the agent with `make_agent` and runs it over standard input and output, until `bye` or the end of the input. An
/// error is written to standard error, which is the agent's log, and sent to the evaluator.
pub fn run<A: Agent>(info: AgentInfo, make_agent: impl FnOnce(&Hello) -> A) -> ExitCode {
    let mut output = io::stdout().lock();
    let Err(error) = serve(info, make_agent, io::stdin().lock(), &mut output) else {
        return ExitCode::SUCCESS;
    };
    let message = error_chain(&error);
    // Errors of these writes are ignored: there is no other place to report them.
    let _logged = writeln!(io::stderr(), "error: {message}");
    let _sent = write_answer(&mut output, &Answer::Error { error: message });
    ExitCode::FAILURE
}

/// Like [`run`], with any input and output.
///
/// # Errors
/// See [`ConversationError`].
pub fn serve<A: Agent>(
    info: AgentInfo,
    make_agent: impl FnOnce(&Hello) -> A,
    input: impl BufRead,
    mut output: impl Write,
) -> Result<(), ConversationError> {
    let mut make_agent = Some(make_agent);
    let mut agent: Option<A> = None;
    for line in input.lines() {
        let line = line?;
        let message = serde_json::from_str(&line)
            .map_err(|source| ConversationError::InvalidMessage { line, source })?;
        let answer = match message {
            Message::Hello(hello) => {
                if hello.protocol != VERSION {
                    return Err(ConversationError::UnsupportedProtocol(hello.protocol));
                }
                agent = make_agent.take().map(|make_agent| make_agent(&hello));
                Answer::Ready(Ready::Hello {
                    protocol: VERSION,
                    info,
                })
            }
            Message::Reset { episode } => {
                let agent = agent.as_mut();
                agent
                    .ok_or(ConversationError::HelloMissing("reset"))?
                    .reset();
                Answer::Ready(Ready::Reset { episode })
            }
            Message::Step { step, obs } => {
                let agent = agent
                    .as_mut()
                    .ok_or(ConversationError::HelloMissing("step"))?;
                let action = agent
                    .act(&obs)
                    .map_err(|failure| ConversationError::ActFailed { step, failure })?;
                if let Some(reason) = action.refusal(info.interpolation) {
                    return Err(ConversationError::InvalidAction { step, reason });
                }
                Answer::Act { step, action }
            }
            Message::End {} => continue,
            Message::Bye {} => return Ok(()),
        };
        write_answer(&mut output, &answer)?;
    }
    Ok(())
}

fn write_answer(output: &mut impl Write, answer: &Answer) -> io::Result<()> {
    let mut line = serde_json::to_vec(answer)?;
    line.push(b'\n');
    output.write_all(&line)?;
    output.flush()
}

/// The error's message, followed by those of its causes.
fn error_chain(error: &dyn Error) -> String {
    let mut message = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        message = format!("{message}: {error}");
        cause = error.source();
    }
    message
}
