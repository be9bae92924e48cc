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

/// The protocol version that this crate speaks.
const VERSION: u32 = 1;

/// What an agent may fail with.
pub type Failure = Box<dyn Error + Send + Sync>;

/// A policy: everything between an observation and an action.
pub trait Agent {
    /// Before each episode, and before each rally of a game. At most 10 s.
    fn reset(&mut self);

    /// The action for an observation: costs points from 20 ms on.
    ///
    /// # Errors
    /// Whatever keeps the agent from acting. It goes to the log and ends the program, which is a fault.
    fn act(&mut self, observation: &Observation) -> Result<Action, Failure>;
}

/// What the program says of itself in `ready`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct About {
    /// Of the program.
    pub name: &'static str,
    /// Of the program.
    pub version: &'static str,
    /// What its actions mean.
    pub interpolation: Interpolation,
}

/// Which behaviour is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Task {
    /// Score against a swinging opponent.
    Hit,
    /// Stop an incoming puck.
    Defend,
    /// Free the puck from the rim.
    Prepare,
    /// Play a whole game.
    Tournament,
}

/// What the evaluator says first.
#[derive(Debug, Clone, Deserialize)]
pub struct Hello {
    protocol: u32,
    /// What is asked for.
    pub task: Task,
    /// 1 or 2: which robot of the table is the agent's own.
    #[serde(default = "first")]
    pub agent_id: u32,
    /// Table, robot and limits.
    pub env: Box<Env>,
}

const fn first() -> u32 {
    1
}

#[derive(Debug, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum Message {
    Hello(Hello),
    Reset { episode: u64 },
    Step { step: u64, obs: Observation },
    End {},
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
    /// No answer to any question: the evaluator takes it as a fault and shows the line to the team.
    Error {
        error: String,
    },
}

#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Ready {
    Hello {
        protocol: u32,
        #[serde(flatten)]
        about: About,
    },
    Reset {
        episode: u64,
    },
}

/// Why a conversation ended before its `bye`.
#[derive(Debug, thiserror::Error)]
pub enum ConversationError {
    /// A line that is no message of the protocol.
    #[error("understand the message {line:.200}")]
    NotUnderstood {
        /// What came.
        line: String,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// The evaluator speaks another version.
    #[error("expected protocol {VERSION}, the evaluator speaks {0}")]
    OtherProtocol(u32),
    /// A question before `hello`.
    #[error("expected hello before {0}")]
    NoHello(&'static str),
    /// The agent could not act.
    #[error("step {step}: {failure}")]
    Failed {
        /// The control step, from 0.
        step: u64,
        /// What the agent said.
        failure: Failure,
    },
    /// An action that the evaluator would refuse.
    #[error("step {step}: {objection}")]
    Refused {
        /// The control step, from 0.
        step: u64,
        /// What is wrong with it.
        objection: String,
    },
    /// The pipe broke.
    #[error("speak with the evaluator")]
    Pipe(#[from] io::Error),
}

/// Lets the agent that `make` makes answer the evaluator over standard input and output, until `bye` or the end of
/// the input. An error goes to standard error, which is the agent's log, and to the evaluator.
pub fn run<A: Agent>(about: About, make: impl FnOnce(&Hello) -> A) -> ExitCode {
    let mut output = io::stdout().lock();
    let Err(error) = serve(about, make, io::stdin().lock(), &mut output) else {
        return ExitCode::SUCCESS;
    };
    let words = with_causes(&error);
    // There is nobody else to tell if the log or the evaluator is gone.
    let _logged = writeln!(io::stderr(), "error: {words}");
    let _said = say(&mut output, &Answer::Error { error: words });
    ExitCode::FAILURE
}

/// As [`run`], with any input and output.
///
/// # Errors
/// [`ConversationError`].
pub fn serve<A: Agent>(
    about: About,
    make: impl FnOnce(&Hello) -> A,
    input: impl BufRead,
    mut output: impl Write,
) -> Result<(), ConversationError> {
    let mut make = Some(make);
    let mut agent: Option<A> = None;
    for line in input.lines() {
        let line = line?;
        let message = serde_json::from_str(&line)
            .map_err(|source| ConversationError::NotUnderstood { line, source })?;
        let answer = match message {
            Message::Hello(hello) => {
                if hello.protocol != VERSION {
                    return Err(ConversationError::OtherProtocol(hello.protocol));
                }
                agent = make.take().map(|make| make(&hello));
                Answer::Ready(Ready::Hello {
                    protocol: VERSION,
                    about,
                })
            }
            Message::Reset { episode } => {
                let agent = agent.as_mut();
                agent.ok_or(ConversationError::NoHello("reset"))?.reset();
                Answer::Ready(Ready::Reset { episode })
            }
            Message::Step { step, obs } => {
                let agent = agent.as_mut().ok_or(ConversationError::NoHello("step"))?;
                let action = agent
                    .act(&obs)
                    .map_err(|failure| ConversationError::Failed { step, failure })?;
                if let Some(objection) = action.objection(about.interpolation) {
                    return Err(ConversationError::Refused { step, objection });
                }
                Answer::Act { step, action }
            }
            Message::End {} => continue,
            Message::Bye {} => return Ok(()),
        };
        say(&mut output, &answer)?;
    }
    Ok(())
}

fn say(output: &mut impl Write, answer: &Answer) -> io::Result<()> {
    let mut line = serde_json::to_vec(answer)?;
    line.push(b'\n');
    output.write_all(&line)?;
    output.flush()
}

fn with_causes(error: &dyn Error) -> String {
    let mut words = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        words = format!("{words}: {error}");
        cause = error.source();
    }
    words
}
