//! The agent's process and single questions to it: a line is sent, a line comes back in time or does
//! not. What the lines mean is the session's business.

use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    fault::{PlatformFault, Trouble},
};
use faceoff_sandbox::{AgentProcess, ReadLine, SpawnError, SpawnSpec, WriteError};
use faceoff_types::{AgentFaultKind, Phase, TimeLimits};
use faceoff_wire::{MAX_LINE_BYTES, Message, answer, quote_line};
use std::time::{Duration, Instant};

/// The running process.
#[derive(Debug)]
pub(crate) struct Exchange {
    process: AgentProcess,
    /// The message being written; its memory is reused.
    line: Vec<u8>,
    /// How long it may take to exit once it has closed its output, so that its status can be told.
    exit_grace: Duration,
}

/// A question that was written and waits for its answer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sent {
    phase: Phase,
    limit_s: f64,
    /// When its last byte was written.
    pub at: Instant,
    /// When the limit has passed.
    pub deadline: Instant,
}

/// The line that came back.
pub(crate) struct Answer {
    pub bytes: Vec<u8>,
    /// When its last byte had been read.
    pub at: Instant,
}

impl Answer {
    /// A fault that this line shows.
    pub fn shows(&self, fault: AgentFaultKind) -> Trouble {
        Trouble::Agent {
            fault,
            line: Some(quote_line(&self.bytes)),
        }
    }
}

impl Exchange {
    /// Starts the bundle's command.
    pub fn start(bundle: &Bundle, env: &AgentEnvironment) -> Result<Self, Trouble> {
        let manifest = &bundle.manifest;
        let Some(runtime) = env.runtimes.get(&manifest.runtime) else {
            let offered: Vec<&str> = env.runtimes.keys().map(String::as_str).collect();
            let detail = format!(
                "the runtime {:?} of agent.toml is not offered here; offered: {}",
                manifest.runtime,
                offered.join(", ")
            );
            return Err(AgentFaultKind::CannotStart { detail }.into());
        };
        let process = AgentProcess::spawn(&SpawnSpec {
            bundle_dir: bundle.dir.clone(),
            command: manifest.command.clone(),
            env: manifest.env.clone(),
            runtime: runtime.clone(),
            limits: env.limits.clone(),
            isolation: env.isolation.clone(),
            cpus: env.agent_cpus.clone(),
        })
        .map_err(|error| match error {
            SpawnError::Agent(fault) => fault.into(),
            SpawnError::Platform(error) => Trouble::from(error),
        })?;
        Ok(Self {
            process,
            line: Vec::with_capacity(4096),
            exit_grace: TimeLimits::duration(env.time.bye_s),
        })
    }

    /// Writes a question; it and its answer have `limit_s` from `from` on.
    pub fn send(
        &mut self,
        message: &Message<'_>,
        phase: Phase,
        limit_s: f64,
        from: Instant,
    ) -> Result<Sent, Trouble> {
        let deadline = from + TimeLimits::duration(limit_s);
        // During start-up anything counts as an answer: the agent runs before `hello` is written.
        if phase != Phase::StartUp && self.process.has_pending_output()? {
            return Err(self.early(phase));
        }
        message.write_line(&mut self.line);
        match self.process.write_line(&self.line, deadline) {
            Ok(at) => Ok(Sent {
                phase,
                limit_s,
                at,
                deadline,
            }),
            Err(WriteError::Closed) => Err(self.closed()),
            Err(WriteError::TimedOut) => Err(AgentFaultKind::TimedOut { phase, limit_s }.into()),
            Err(WriteError::Platform(error)) => Err(error.into()),
        }
    }

    /// Waits for the answer until `until`, which may have passed, or until its deadline; `None` if it
    /// may still come.
    pub fn poll(&mut self, sent: &Sent, until: Instant) -> Result<Option<Answer>, Trouble> {
        let Sent {
            phase,
            limit_s,
            deadline,
            ..
        } = *sent;
        let read = self
            .process
            .read_line(MAX_LINE_BYTES, until.min(deadline))?;
        match read {
            ReadLine::Line { bytes, at } => Ok(Some(Answer { bytes, at })),
            ReadLine::TooLong { head } => Err(too_long(&head)),
            ReadLine::TimedOut if until < deadline => Ok(None),
            ReadLine::TimedOut => Err(AgentFaultKind::TimedOut { phase, limit_s }.into()),
            ReadLine::Closed => Err(self.closed()),
        }
    }

    /// Waits for the answer.
    pub fn wait(&mut self, sent: &Sent) -> Result<Answer, Trouble> {
        loop {
            if let Some(answer) = self.poll(sent, sent.deadline)? {
                return Ok(answer);
            }
        }
    }

    /// Waits until one of several agents has written something, until its silence is to be looked
    /// into, or until `until`.
    pub fn wait_for_any(exchanges: &[&Self], until: Instant) -> Result<(), PlatformFault> {
        let processes: Vec<&AgentProcess> = exchanges.iter().map(|one| &one.process).collect();
        Ok(AgentProcess::wait_for_any(&processes, until)?)
    }

    /// Writes a message that is not answered. An agent that no longer listens meets its fault at the
    /// next question.
    pub fn tell(&mut self, message: &Message<'_>, limit_s: f64) -> Result<(), PlatformFault> {
        message.write_line(&mut self.line);
        let deadline = Instant::now() + TimeLimits::duration(limit_s);
        match self.process.write_line(&self.line, deadline) {
            Ok(_) | Err(WriteError::Closed | WriteError::TimedOut) => Ok(()),
            Err(WriteError::Platform(error)) => Err(error.into()),
        }
    }

    /// CPU time of the whole process tree so far, in seconds, where the host tells.
    pub fn cpu_time_s(&self) -> Option<f64> {
        self.process.cpu_time_s()
    }

    /// Gives the agent `grace` to exit, then kills it; returns the end of its standard error.
    pub fn finish(self, grace: Duration) -> Result<String, PlatformFault> {
        Ok(self.process.finish(grace)?.stderr_tail)
    }

    /// The agent has written before it was asked, or has closed its output.
    fn early(&mut self, phase: Phase) -> Trouble {
        let fault = AgentFaultKind::WrongMessage {
            expected: format!("no output before the next question ({phase})"),
            got: "a line that was not asked for".to_owned(),
        };
        match self.process.read_line(MAX_LINE_BYTES, Instant::now()) {
            Ok(ReadLine::Line { bytes, .. }) => Trouble::Agent {
                fault,
                line: Some(quote_line(&bytes)),
            },
            Ok(ReadLine::TimedOut) => fault.into(),
            Ok(ReadLine::TooLong { head }) => too_long(&head),
            Ok(ReadLine::Closed) => self.closed(),
            Err(error) => error.into(),
        }
    }

    /// The agent's end of a pipe is closed: by exit, by a kill, or by itself.
    fn closed(&mut self) -> Trouble {
        match self.process.diagnose_end(self.exit_grace) {
            Ok(end) => end.unwrap_or(AgentFaultKind::ClosedOutput).into(),
            Err(ours) => ours.into(),
        }
    }
}

fn too_long(head: &[u8]) -> Trouble {
    Trouble::Agent {
        fault: answer::too_long(),
        line: Some(quote_line(head)),
    }
}
