use crate::{AgentEnvironment, PlatformFault, TimeLimits, bundle::Bundle, wire_env::wire_env};
use faceoff_episode::Answered;
use faceoff_sandbox::{AgentProcess, ReadLine, SpawnError, SpawnSpec, WriteError};
use faceoff_types::{AgentFaultKind, Task};
use faceoff_wire::{InterpolationCode, MAX_LINE_BYTES, Message, answer, quote_line};
use std::time::{Duration, Instant};

/// What ended a conversation.
#[derive(Debug)]
pub enum Trouble {
    /// The agent broke the protocol or a limit.
    Agent {
        /// How.
        fault: AgentFaultKind,
        /// The offending line, cut, where there was one.
        line: Option<String>,
    },
    /// The platform failed.
    Platform(PlatformFault),
}

impl From<PlatformFault> for Trouble {
    fn from(fault: PlatformFault) -> Self {
        Self::Platform(fault)
    }
}

/// One agent process and the conversation with it. Every wait has a deadline. Dropping it kills
/// the process tree.
#[derive(Debug)]
pub struct Session {
    process: AgentProcess,
    time: TimeLimits,
    interpolation: InterpolationCode,
    /// The message being written; its memory is reused.
    line: Vec<u8>,
    cpu_time_s: Option<f64>,
    /// From the last question's last byte to its answer, or to the end of the wait for one.
    waited: Option<(Instant, Instant)>,
}

/// A question's wait: its name and limit, as a fault tells them.
#[derive(Debug, Clone, Copy)]
struct Wait {
    phase: &'static str,
    limit_s: f64,
}

struct Answer {
    bytes: Vec<u8>,
    asked: Instant,
    answered: Instant,
}

impl Session {
    /// Starts the bundle's command and exchanges `hello` and `ready`.
    ///
    /// # Errors
    /// What went wrong, and what the agent had written to standard error.
    pub fn start(
        bundle: &Bundle,
        env: &AgentEnvironment,
        task: Task,
    ) -> Result<Self, (Trouble, String)> {
        let manifest = &bundle.manifest;
        let Some(runtime) = env.runtimes.get(&manifest.runtime) else {
            let offered: Vec<&str> = env.runtimes.keys().map(String::as_str).collect();
            let detail = format!(
                "the runtime {:?} of agent.toml is not offered here; offered: {}",
                manifest.runtime,
                offered.join(", ")
            );
            let fault = AgentFaultKind::CannotStart { detail };
            return Err((Trouble::Agent { fault, line: None }, String::new()));
        };
        let started = Instant::now();
        let spec = SpawnSpec {
            bundle_dir: bundle.dir.clone(),
            command: manifest.command.clone(),
            env: manifest.env.clone(),
            runtime: runtime.clone(),
            limits: env.limits.clone(),
            isolation: env.isolation.clone(),
            cpus: env.agent_cpus.clone(),
        };
        let process = AgentProcess::spawn(&spec).map_err(|error| {
            let trouble = match error {
                SpawnError::Agent(fault) => Trouble::Agent { fault, line: None },
                SpawnError::Platform(error) => Trouble::Platform(error.into()),
            };
            (trouble, String::new())
        })?;
        let mut session = Self {
            process,
            time: env.time.clone(),
            interpolation: InterpolationCode::new(None).expect("null is a code"),
            line: Vec::with_capacity(4096),
            cpu_time_s: None,
            waited: None,
        };
        match session.hello(started, manifest.interpolation, task) {
            Ok(()) => Ok(session),
            Err(trouble) => Err((trouble, session.abort())),
        }
    }

    fn hello(&mut self, started: Instant, stated: Option<i64>, task: Task) -> Result<(), Trouble> {
        let wait = Wait {
            phase: "start-up",
            limit_s: self.time.startup_s,
        };
        Message::hello(task, wire_env(task)).write_line(&mut self.line);
        let answer = self.ask(wait, started)?;
        let ready = answer::parse_ready(&answer.bytes).map_err(|fault| at_line(fault, &answer))?;
        if let Some(stated) = stated
            && ready.interpolation.code() != Some(stated)
        {
            let fault = AgentFaultKind::WrongMessage {
                expected: format!("ready with interpolation {stated}, as agent.toml says"),
                got: format!("ready with interpolation {}", ready.interpolation),
            };
            return Err(at_line(fault, &answer));
        }
        self.interpolation = ready.interpolation;
        Ok(())
    }

    /// What the agent's actions mean.
    #[must_use]
    pub const fn interpolation(&self) -> InterpolationCode {
        self.interpolation
    }

    /// Announces an episode.
    ///
    /// # Errors
    /// The agent's fault or the platform's.
    pub fn reset(&mut self, episode: u32) -> Result<(), Trouble> {
        let wait = Wait {
            phase: "reset",
            limit_s: self.time.reset_s,
        };
        Message::Reset { episode }.write_line(&mut self.line);
        let answer = self.ask(wait, Instant::now())?;
        answer::parse_reset_ready(&answer.bytes, episode)
            .map_err(|fault| at_line(fault, &answer))?;
        self.cpu_time_s = self.process.cpu_time_s();
        Ok(())
    }

    /// Asks for the action of a step, into `action` (row-major, of the agreed interpolation's
    /// length).
    ///
    /// # Errors
    /// The agent's fault or the platform's.
    pub fn step(
        &mut self,
        step: u32,
        observation: &[f64],
        action: &mut Vec<f64>,
    ) -> Result<Answered, Trouble> {
        if !observation.iter().all(|value| value.is_finite()) {
            // JSON would say null, and the agent would be blamed for what it makes of it.
            return Err(Trouble::Platform(PlatformFault::Recording(format!(
                "the simulator's observation of step {step} is not finite"
            ))));
        }
        let wait = Wait {
            phase: "step",
            limit_s: self.time.step_s,
        };
        Message::step(step, observation).write_line(&mut self.line);
        let answer = self.ask(wait, Instant::now())?;
        answer::parse_act(&answer.bytes, step, self.interpolation, action)
            .map_err(|fault| at_line(fault, &answer))?;
        let before = self.cpu_time_s;
        self.cpu_time_s = self.process.cpu_time_s();
        Ok(Answered {
            computation_time_s: answer
                .answered
                .saturating_duration_since(answer.asked)
                .as_secs_f64(),
            cpu_time_s: before
                .zip(self.cpu_time_s)
                .map(|(before, now)| (now - before).max(0.0)),
        })
    }

    /// When the last question had been asked, and when its answer came or was no longer waited for.
    /// `None` when it could not even be asked.
    pub(crate) const fn waited(&self) -> Option<(Instant, Instant)> {
        self.waited
    }

    /// CPU time that the agent's process tree used since its last answer, in seconds, where the host
    /// tells.
    pub(crate) fn cpu_time_since_answer_s(&mut self) -> Option<f64> {
        let before = self.cpu_time_s?;
        Some((self.process.cpu_time_s()? - before).max(0.0))
    }

    /// Tells that an episode is over. An agent that no longer listens meets its fault at the next
    /// question.
    ///
    /// # Errors
    /// The platform's alone.
    pub fn end(&mut self, episode: u32, steps: u32) -> Result<(), PlatformFault> {
        Message::End { episode, steps }.write_line(&mut self.line);
        self.tell(TimeLimits::duration(self.time.step_s))
    }

    /// Says goodbye, waits for the exit, kills what is left, and returns the end of the agent's
    /// standard error.
    ///
    /// # Errors
    /// The platform's alone: how an agent exits is its own affair by now.
    pub fn finish(mut self) -> Result<String, PlatformFault> {
        let grace = TimeLimits::duration(self.time.bye_s);
        Message::Bye.write_line(&mut self.line);
        self.tell(grace)?;
        Ok(self.process.finish(grace)?.stderr_tail)
    }

    /// Kills the agent and returns the end of its standard error.
    pub fn abort(self) -> String {
        match self.process.finish(Duration::ZERO) {
            Ok(usage) => usage.stderr_tail,
            Err(error) => {
                tracing::error!(%error, "an agent's end could not be observed");
                String::new()
            }
        }
    }

    /// Writes the line without expecting an answer.
    fn tell(&mut self, limit: Duration) -> Result<(), PlatformFault> {
        match self.process.write_line(&self.line, Instant::now() + limit) {
            Ok(_) | Err(WriteError::Closed | WriteError::TimedOut) => Ok(()),
            Err(WriteError::Platform(error)) => Err(error.into()),
        }
    }

    /// Writes the line and waits for one line in return, both before `from` plus the limit.
    fn ask(&mut self, wait: Wait, from: Instant) -> Result<Answer, Trouble> {
        let deadline = from + TimeLimits::duration(wait.limit_s);
        // During start-up anything counts as an answer: the agent runs before `hello` is written.
        if wait.phase != "start-up" && self.process.has_pending_output().map_err(platform)? {
            return Err(self.early(wait));
        }
        self.waited = None;
        let asked = match self.process.write_line(&self.line, deadline) {
            Ok(asked) => asked,
            Err(WriteError::Closed) => return Err(self.closed()),
            Err(WriteError::TimedOut) => return Err(timed_out(wait)),
            Err(WriteError::Platform(error)) => return Err(platform(error)),
        };
        match self
            .process
            .read_line(MAX_LINE_BYTES, deadline)
            .map_err(platform)?
        {
            ReadLine::Line { bytes, at } => {
                self.waited = Some((asked, at));
                Ok(Answer {
                    bytes,
                    asked,
                    answered: at,
                })
            }
            ReadLine::TooLong { head } => Err(too_long(&head)),
            ReadLine::TimedOut => {
                self.waited = Some((asked, Instant::now()));
                Err(timed_out(wait))
            }
            ReadLine::Closed => Err(self.closed()),
        }
    }

    /// The agent has written before it was asked, or has closed its output.
    fn early(&mut self, wait: Wait) -> Trouble {
        let fault = AgentFaultKind::WrongMessage {
            expected: format!("no output before the next question ({})", wait.phase),
            got: "a line that was not asked for".to_owned(),
        };
        match self.process.read_line(MAX_LINE_BYTES, Instant::now()) {
            Ok(ReadLine::Line { bytes, .. }) => Trouble::Agent {
                fault,
                line: Some(quote_line(&bytes)),
            },
            Ok(ReadLine::TimedOut) => Trouble::Agent { fault, line: None },
            Ok(ReadLine::TooLong { head }) => too_long(&head),
            Ok(ReadLine::Closed) => self.closed(),
            Err(error) => platform(error),
        }
    }

    /// The agent's end of a pipe is closed: by exit, by a kill, or by itself. As after `bye` it gets time to
    /// exit, so that its status can be told.
    fn closed(&mut self) -> Trouble {
        let fault = self
            .process
            .diagnose_end(TimeLimits::duration(self.time.bye_s))
            .unwrap_or(AgentFaultKind::ClosedOutput);
        Trouble::Agent { fault, line: None }
    }
}

fn platform(error: faceoff_sandbox::SandboxError) -> Trouble {
    Trouble::Platform(error.into())
}

fn timed_out(wait: Wait) -> Trouble {
    let fault = AgentFaultKind::TimedOut {
        phase: wait.phase.to_owned(),
        limit_s: wait.limit_s,
    };
    Trouble::Agent { fault, line: None }
}

fn too_long(head: &[u8]) -> Trouble {
    Trouble::Agent {
        fault: answer::too_long(),
        line: Some(quote_line(head)),
    }
}

fn at_line(fault: AgentFaultKind, answer: &Answer) -> Trouble {
    Trouble::Agent {
        fault,
        line: Some(quote_line(&answer.bytes)),
    }
}
