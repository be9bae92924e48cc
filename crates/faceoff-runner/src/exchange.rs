//! The agent's process and single questions to it: a line is sent, a line comes back in time or does
//! not, and whose doing that is. What the lines mean is the session's business.

use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    fault::{PlatformFault, Trouble},
    host_watch::{Evidence, GLANCE_LASTS, HostWatch, Over, Wait},
    waited::Waited,
};
use faceoff_sandbox::{
    AgentProcess, CpuReading, Layer, ReadLine, Runtime, SpawnError, SpawnSpec, WriteError, affinity,
};
use faceoff_types::{AgentFaultKind, Phase, TimeLimits};
use faceoff_wire::{MAX_LINE_BYTES, Message, answer, quote_line};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// Who answered within this time is looked out for as long at the next question, where that costs the agent
/// nothing: to sleep and be woken takes longer than such an answer.
const QUICK: Duration = Duration::from_micros(50);

/// The running process.
#[derive(Debug)]
pub(crate) struct Exchange<'w> {
    process: AgentProcess,
    watch: &'w dyn HostWatch,
    /// Does the agent keep to CPUs that the calling thread keeps off?
    apart: bool,
    /// Was its last answer a quick one?
    is_quick: bool,
    /// What the counters said at the last glance.
    glance: Option<Arc<CpuReading>>,
    /// The message being sent; its memory is reused.
    line: Vec<u8>,
    /// CPU time of the whole process tree at its last answer, or when it was asked long after that, in seconds, where
    /// the host tells.
    cpu_time_s: Option<f64>,
    /// When that was.
    cpu_time_at: Instant,
    /// How long it may take to exit once it has closed its output, so that its status can be told.
    exit_grace: Duration,
}

/// A question that waits for its answer.
#[derive(Debug, Clone)]
pub(crate) struct Sent {
    phase: Phase,
    limit_s: f64,
    wait: Wait,
}

/// The line that came back.
pub(crate) struct Answer {
    pub bytes: Vec<u8>,
    /// To the answer's last byte.
    pub waited: Waited,
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

impl Sent {
    /// The evaluator could not look for the answer for so long: it saw to another agent.
    pub fn was_away(&mut self, away: Duration) {
        self.wait.was_away(away);
    }
}

impl<'w> Exchange<'w> {
    /// Starts the bundle's command.
    pub fn start(
        bundle: &Bundle,
        env: &AgentEnvironment,
        watch: &'w dyn HostWatch,
    ) -> Result<Self, Trouble> {
        let manifest = &bundle.manifest;
        let runtime =
            runtime_of(bundle, env).map_err(|detail| AgentFaultKind::CannotStart { detail })?;
        let mut variables = bundle
            .image
            .as_ref()
            .map(|image| image.env.clone())
            .unwrap_or_default();
        variables.extend(manifest.env.clone());
        let process = AgentProcess::spawn(&SpawnSpec {
            bundle_dir: bundle.dir.clone(),
            command: manifest.command.clone(),
            env: variables,
            runtime,
            limits: env.limits.clone(),
            isolation: env.isolation.clone(),
            cpus: env.agent_cpus.clone(),
        })
        .map_err(|error| match error {
            SpawnError::Agent(fault) => fault.into(),
            SpawnError::Platform(error) => Trouble::from(error),
        })?;
        let apart = !env.agent_cpus.is_empty()
            && affinity::allowed()
                .is_ok_and(|own| own.iter().all(|cpu| !env.agent_cpus.contains(cpu)));
        Ok(Self {
            cpu_time_s: process.cpu_time_s(),
            cpu_time_at: Instant::now(),
            process,
            watch,
            apart,
            is_quick: false,
            glance: None,
            line: Vec::with_capacity(4096),
            exit_grace: TimeLimits::duration(env.time.bye_s),
        })
    }

    /// Asks a question without waiting; to write it and to be answered share one limit of `limit_s`.
    pub fn send(
        &mut self,
        message: &Message<'_>,
        phase: Phase,
        limit_s: f64,
    ) -> Result<Sent, Trouble> {
        // During start-up anything counts as an answer: the agent runs before `hello` is sent.
        if phase != Phase::StartUp && self.process.has_pending_output()? {
            return Err(self.early(phase));
        }
        message.write_line(&mut self.line);
        let before = self.glance(phase);
        // In a game it may have been the other side's turn meanwhile: what it ran then is not of this wait.
        if self.cpu_time_at.elapsed() >= GLANCE_LASTS {
            self.cpu_time_s = self.process.cpu_time_s();
            self.cpu_time_at = Instant::now();
        }
        match self.process.send_line(&self.line) {
            Ok(asked) => {
                let limit = TimeLimits::duration(limit_s);
                let wait = Wait::begin(before, asked, Instant::now(), limit);
                Ok(Sent {
                    phase,
                    limit_s,
                    wait,
                })
            }
            Err(WriteError::Closed) => Err(self.closed()),
            Err(WriteError::Platform(error)) => Err(error.into()),
        }
    }

    /// The counters before a question, which may be as old as [`GLANCE_LASTS`]: to read them for each of an
    /// instant agent's questions would cost more than the answer.
    fn glance(&mut self, phase: Phase) -> Option<Arc<CpuReading>> {
        if phase != Phase::Step {
            self.process.know_threads();
            self.glance = None;
        }
        let is_fresh = |glance: &Arc<CpuReading>| glance.at().elapsed() < GLANCE_LASTS;
        if !self.glance.as_ref().is_some_and(is_fresh) {
            self.glance = self.process.glance_at_cpus().map(Arc::new);
        }
        self.glance.clone()
    }

    /// Waits for the answer until `until`, which may have passed, or until its limit is over; `None` if it
    /// may still come.
    pub fn poll(&mut self, sent: &mut Sent, until: Instant) -> Result<Option<Answer>, Trouble> {
        if self.apart && self.is_quick {
            self.process.look_out(until.min(sent.wait.asked + QUICK))?;
        }
        loop {
            let stop = until.min(sent.wait.wake);
            match self.process.read_line(MAX_LINE_BYTES, stop)? {
                // It cannot know yet what it is asked.
                ReadLine::Line { bytes, .. }
                    if sent.phase != Phase::StartUp && !self.process.has_taken_all() =>
                {
                    return Err(unasked(sent.phase, &bytes));
                }
                ReadLine::Line { bytes, at } => return Ok(Some(self.answer(sent, bytes, at))),
                ReadLine::TooLong { head } => return Err(too_long(&head)),
                ReadLine::Closed => return Err(self.closed()),
                ReadLine::TimedOut => {
                    sent.wait.nothing_is_there();
                    self.look(sent)?;
                }
            }
            if until <= stop {
                return Ok(None);
            }
        }
    }

    /// Waits for the answer.
    pub fn wait(&mut self, sent: &mut Sent) -> Result<Answer, Trouble> {
        loop {
            let until = Instant::now() + TimeLimits::LONGEST;
            if let Some(answer) = self.poll(sent, until)? {
                return Ok(answer);
            }
        }
    }

    /// Waits until one of several agents has something for [`Self::poll`], which is due at `until` in any
    /// case.
    pub fn wait_for_any(asked: &[(&Self, &Sent)], until: Instant) -> Result<(), PlatformFault> {
        let processes: Vec<&AgentProcess> = asked.iter().map(|(one, _)| &one.process).collect();
        let until = asked
            .iter()
            .fold(until, |until, (_, sent)| until.min(sent.wait.wake));
        Ok(AgentProcess::wait_for_any(&processes, until)?)
    }

    /// Sends a message that is not answered, without waiting. What the agent leaves no room for costs it
    /// time at the next question; if it no longer listens, it meets its fault there.
    pub fn tell(&mut self, message: &Message<'_>) -> Result<(), PlatformFault> {
        message.write_line(&mut self.line);
        match self.process.send_line(&self.line) {
            Ok(_) | Err(WriteError::Closed) => Ok(()),
            Err(WriteError::Platform(error)) => Err(error.into()),
        }
    }

    fn answer(&mut self, sent: &Sent, bytes: Vec<u8>, at: Instant) -> Answer {
        let cpu_time_s = self.process.cpu_time_s();
        let waited = self.waited(sent, at, used_s(self.cpu_time_s, cpu_time_s));
        self.cpu_time_s = cpu_time_s;
        self.cpu_time_at = at;
        self.is_quick = waited.wall < QUICK;
        Answer { bytes, waited }
    }

    /// Nothing has come when the evaluator wanted to be woken.
    fn look(&self, sent: &mut Sent) -> Result<(), Trouble> {
        let (now, wait) = (Instant::now(), &mut sent.wait);
        if now >= wait.deadline {
            let used_s = used_s(self.cpu_time_s, self.process.cpu_time_s());
            let waited = self.waited(sent, now, used_s);
            let fault = AgentFaultKind::TimedOut {
                phase: sent.phase,
                limit_s: sent.limit_s,
            };
            let (over, waited) = (sent.wait.extend(now, waited.host), Box::new(waited));
            return match over {
                Over::No => Ok(()),
                Over::ByTheAgent => Err(Trouble::Late { fault, waited }),
                Over::ByTheHost => Err(Trouble::Host { fault, waited }),
            };
        }
        if now >= wait.wake {
            wait.look(self.process.read_cpus());
            // From when it was seen that nothing is there: an evaluator that is held up after that is late.
            wait.sleep_on(now);
        }
        Ok(())
    }

    /// The wait for an answer until `now`; `agent_ran_s` is the CPU time since the answer before, or since it was asked
    /// if that was long ago.
    fn waited(&self, sent: &Sent, now: Instant, agent_ran_s: Option<f64>) -> Waited {
        Waited {
            wall: now.saturating_duration_since(sent.wait.asked),
            host: self.taken_by_host(sent, now, agent_ran_s),
            cpu_time_s: agent_ran_s,
        }
    }

    fn taken_by_host(&self, sent: &Sent, now: Instant, agent_ran_s: Option<f64>) -> Duration {
        if !sent.wait.is_late(now) {
            return Duration::ZERO;
        }
        let wait = &sent.wait;
        let taken =
            self.process
                .taken_from_it_since(wait.asked, wait.first_reading(), wait.before());
        let evidence = Evidence {
            now,
            kept: taken.map(|taken| taken.kept),
            most: taken.map_or(Duration::ZERO, |taken| taken.most),
            stolen: taken.map_or(Duration::ZERO, |taken| taken.stolen),
            agent_ran: agent_ran_s.map(TimeLimits::duration),
            apart: self.apart,
        };
        sent.wait.taken(self.watch, evidence)
    }

    /// Gives the agent `grace` to exit, then kills it; returns the end of its standard error.
    pub fn finish(self, grace: Duration) -> Result<String, PlatformFault> {
        Ok(self.process.finish(grace)?.stderr_tail)
    }

    /// The agent has written before it was asked, or has closed its output.
    fn early(&mut self, phase: Phase) -> Trouble {
        match self.process.read_line(MAX_LINE_BYTES, Instant::now()) {
            Ok(ReadLine::Line { bytes, .. }) => unasked(phase, &bytes),
            Ok(ReadLine::TimedOut) => unasked_for(phase).into(),
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

/// What the agent sees beside its bundle: its image, or the runtime that it names; or why it cannot be had.
fn runtime_of(bundle: &Bundle, env: &AgentEnvironment) -> Result<Runtime, String> {
    let name = &bundle.manifest.runtime;
    if let Some(image) = &bundle.image {
        if !env.isolation.enforces(Layer::Namespaces) {
            return Err(
                "the agent is a container image, which runs in the sandbox only: its namespaces are given up here"
                    .to_owned(),
            );
        }
        if env.images {
            return Ok(Runtime::of_image(&image.root, image.path()));
        }
    } else if let Some(runtime) = env.runtimes.get(name) {
        return Ok(runtime.clone());
    }
    Err(format!(
        "the runtime {name:?} of agent.toml is not offered here; offered: {}",
        env.offered().join(", ")
    ))
}

fn too_long(head: &[u8]) -> Trouble {
    Trouble::Agent {
        fault: answer::too_long(),
        line: Some(quote_line(head)),
    }
}

fn unasked_for(phase: Phase) -> AgentFaultKind {
    AgentFaultKind::WrongMessage {
        expected: format!("no output before the next question ({phase})"),
        got: "a line that was not asked for".to_owned(),
    }
}

fn unasked(phase: Phase, line: &[u8]) -> Trouble {
    Trouble::Agent {
        fault: unasked_for(phase),
        line: Some(quote_line(line)),
    }
}

/// What was used between two looks at a clock, in seconds.
fn used_s(before_s: Option<f64>, now_s: Option<f64>) -> Option<f64> {
    Some((now_s? - before_s?).max(0.0))
}
