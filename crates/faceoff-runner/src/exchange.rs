//! The agent's process and single questions to it: a line is sent, a line comes back in time or does
//! not, and whose doing that is. What the lines mean is the session's business.

use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    cpu_use::CpuUse,
    fault::{PlatformFault, Trouble},
    host_watch::{Evidence, GLANCE_LASTS, HostWatch, LONGEST_EXTENSION, Over, Wait},
    supervisor::{Busy, Ended, Supervised},
    waited::Waited,
};
use faceoff_sandbox::{
    AgentProcess, AnswerState, Glance, Layer, ReadLine, Runtime, SpawnError, SpawnSpec, WriteError,
    affinity,
};
use faceoff_types::{AgentFaultKind, Phase, TimeLimits};
use faceoff_wire::{MAX_LINE_BYTES, Message, answer, quote_line};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// Who answered within this time is looked out for as long at the next question, where that costs the agent
/// nothing: to sleep and be woken takes about as long as such an answer, an interpreter's included.
const QUICK: Duration = Duration::from_micros(100);

#[derive(Debug)]
pub(crate) struct Exchange<'w> {
    process: AgentProcess,
    supervised: Supervised,
    watch: &'w dyn HostWatch,
    /// The calling thread's CPUs, if the agent keeps off all of them.
    own_cpus: Option<Vec<usize>>,
    /// Was its last answer a quick one?
    is_quick: bool,
    /// What the counters said at the last glance.
    glance: Option<Arc<Glance>>,
    /// The message being sent; its memory is reused.
    line: Vec<u8>,
    cpu: CpuUse,
    /// How long it may take to exit once it has closed its output, so that its status can be told.
    exit_grace: Duration,
}

/// A question that waits for its answer.
#[derive(Debug, Clone)]
pub(crate) struct Sent {
    phase: Phase,
    limit_s: f64,
    wait: Wait,
    /// CPU time that the agent used between its last answer and this question.
    head_start: Duration,
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
        let own_cpus = affinity::allowed().ok().filter(|own| {
            !env.agent_cpus.is_empty() && own.iter().all(|cpu| !env.agent_cpus.contains(cpu))
        });
        Ok(Self {
            supervised: Supervised::new(process.killer()?, &env.supervision),
            cpu: CpuUse::begin(process.cpu_time_s(), env),
            process,
            watch,
            own_cpus,
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
        message.write_line(&mut self.line);
        let glance = self.glance(phase);
        // From here on whatever it takes is the agent's: the calls that follow meet what it can reach.
        let asked = Instant::now();
        let limit = TimeLimits::duration(limit_s);
        let _busy = self.supervised.busy(self.longest(asked, limit));
        let sent = self.ask(asked, phase);
        let sent = sent.map(|head_start| Sent {
            phase,
            limit_s,
            wait: Wait::begin(Some(glance), asked, Instant::now(), limit),
            head_start,
        });
        self.unless_ended(sent, phase, limit_s, asked)
    }

    /// Sends the line; returns the agent's head start.
    fn ask(&mut self, asked: Instant, phase: Phase) -> Result<Duration, Trouble> {
        self.process.thaw();
        // During start-up anything counts as an answer: the agent runs before `hello` is sent.
        if phase != Phase::StartUp && self.process.has_pending_output()? {
            return Err(self.early(phase));
        }
        let head_start = self.cpu.asked(asked, || self.process.cpu_time_s());
        match self.process.send_line(&self.line) {
            Ok(()) => Ok(head_start),
            Err(WriteError::Closed) => Err(self.closed()),
            Err(WriteError::Platform(error)) => Err(error.into()),
        }
    }

    /// The latest that all limits of a wait can be over, however often it is extended.
    fn longest(&self, asked: Instant, limit: Duration) -> Instant {
        asked + limit * (1 + LONGEST_EXTENSION) + self.exit_grace
    }

    /// What the supervisor says is what happened: the rest follows from the agent's death.
    fn unless_ended<T>(
        &self,
        came: Result<T, Trouble>,
        phase: Phase,
        limit_s: f64,
        asked: Instant,
    ) -> Result<T, Trouble> {
        match self.supervised.ended() {
            None => came,
            Some(Ended::Cancelled) => Err(PlatformFault::Cancelled.into()),
            Some(Ended::Stalled) => Err(Trouble::Late {
                fault: AgentFaultKind::TimedOut { phase, limit_s },
                waited: Box::new(Waited {
                    wall: asked.elapsed(),
                    host: Duration::ZERO,
                    head_start: Duration::ZERO,
                    cpu_time_s: None,
                }),
            }),
        }
    }

    /// The counters before a question, which may be as old as [`GLANCE_LASTS`]: to read them for each of an
    /// instant agent's questions would cost more than the answer. They are the kernel's: no agent holds one.
    fn glance(&mut self, phase: Phase) -> Arc<Glance> {
        if phase != Phase::Step {
            self.process.know_threads();
            self.glance = None;
        }
        match &self.glance {
            Some(glance) if glance.at.elapsed() < GLANCE_LASTS => Arc::clone(glance),
            _ => {
                let glance = self.process.glance_at_cpus(self.own_cpus.as_deref());
                Arc::clone(self.glance.insert(Arc::new(glance)))
            }
        }
    }

    /// Stops the agent until it is asked again, where the host has something that does.
    pub fn freeze(&mut self) {
        self.process.freeze();
    }

    /// Can it be stopped?
    pub fn can_freeze(&self) -> bool {
        self.process.can_freeze()
    }

    /// Waits for the answer until `until`, which may have passed, or until its limit is over; `None` if it
    /// may still come.
    pub fn poll(&mut self, sent: &mut Sent, until: Instant) -> Result<Option<Answer>, Trouble> {
        let (phase, limit_s, asked) = (sent.phase, sent.limit_s, sent.wait.asked);
        let due = self.longest(asked, TimeLimits::duration(limit_s));
        let _busy = self.supervised.busy(due);
        let came = self.await_answer(sent, until);
        self.unless_ended(came, phase, limit_s, asked)
    }

    fn await_answer(&mut self, sent: &mut Sent, until: Instant) -> Result<Option<Answer>, Trouble> {
        if self.own_cpus.is_some() && self.is_quick {
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
        let _busy: Vec<Busy> = asked
            .iter()
            .map(|(one, sent)| {
                let limit = TimeLimits::duration(sent.limit_s);
                one.supervised.busy(one.longest(sent.wait.asked, limit))
            })
            .collect();
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
        let _busy = self.supervised.busy(Instant::now() + self.exit_grace);
        match self.process.send_line(&self.line) {
            Ok(()) | Err(WriteError::Closed) => Ok(()),
            Err(WriteError::Platform(error)) => Err(error.into()),
        }
    }

    fn answer(&mut self, sent: &Sent, bytes: Vec<u8>, at: Instant) -> Answer {
        let used_s = self.process.cpu_time_s();
        let waited = self.waited(sent, at, used_s, AnswerState::Taken);
        self.cpu.answered(at, used_s);
        self.is_quick = waited.wall < QUICK;
        Answer { bytes, waited }
    }

    /// Nothing has come when the evaluator wanted to be woken.
    fn look(&mut self, sent: &mut Sent) -> Result<(), Trouble> {
        let now = Instant::now();
        if now >= sent.wait.deadline {
            let used_s = self.process.cpu_time_s();
            let waited = self.waited(sent, now, used_s, AnswerState::Pending);
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
        let wait = &mut sent.wait;
        if now >= wait.wake {
            if wait.is_first_look() {
                // Those that it has begun since are among them, too.
                self.process.know_threads();
            }
            wait.look(self.process.read_cpus());
            // From when it was seen that nothing is there: an evaluator that is held up after that is late.
            wait.sleep_on(now);
        }
        Ok(())
    }

    /// The wait for an answer until `now`, when the agent had used `used_s` of CPU time.
    fn waited(
        &self,
        sent: &Sent,
        now: Instant,
        used_s: Option<f64>,
        answer: AnswerState,
    ) -> Waited {
        let ran_s = self.cpu.since_question_s(used_s);
        Waited {
            wall: now.saturating_duration_since(sent.wait.asked),
            host: self.taken_by_host(&sent.wait, now, ran_s, answer),
            head_start: sent.head_start,
            cpu_time_s: self.cpu.since_answer_s(used_s),
        }
    }

    fn taken_by_host(
        &self,
        wait: &Wait,
        now: Instant,
        ran_s: Option<f64>,
        answer: AnswerState,
    ) -> Duration {
        if !wait.is_late(now) {
            return Duration::ZERO;
        }
        let taken =
            self.process
                .taken_from_it_since(wait.asked, wait.looks(), wait.cpus_before(), answer);
        let own = self.own_cpus.as_deref().zip(wait.own_before());
        let evidence = Evidence {
            now,
            kept: taken.map(|taken| taken.kept),
            stolen: taken.map_or(Duration::ZERO, |taken| taken.stolen),
            agent_ran: ran_s.map(TimeLimits::duration),
            own_wait: own.map(|(cpus, before)| self.process.own_wait(cpus).since(before)),
        };
        wait.taken(self.watch, evidence)
    }

    /// Gives the agent `grace` to exit, then kills it; returns the end of its standard error.
    pub fn finish(self, grace: Duration) -> Result<String, PlatformFault> {
        let Self {
            process,
            supervised,
            ..
        } = self;
        let _busy = supervised.busy(Instant::now() + grace);
        Ok(process.finish(grace)?.stderr_tail)
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

    /// The agent's end of a channel is closed: by exit, by a kill, or by itself.
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
