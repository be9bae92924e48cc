//! The agent's process and single exchanges with it: this module sends a question (a line of the protocol), waits for
//! the answer until its limit, and classifies failures as agent fault or platform fault. The *evaluator* is the thread
//! that asks and waits. [`Session`](crate::Session) interprets the lines.

use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    cpu_usage::CpuUsage,
    fault::{PlatformFault, SessionError},
    host_interference::{
        AnswerWait, BASELINE_MAX_AGE, Extension, InterferenceMonitor, MAX_EXTENSION, WaitCounters,
    },
    supervisor::{BusyGuard, KillReason, SupervisedAgent},
    wait_breakdown::WaitBreakdown,
};
use faceoff_sandbox::{
    AgentProcess, AnswerState, CounterBaseline, Layer, ReadLine, Runtime, SpawnError, SpawnSpec,
    WriteError, affinity,
};
use faceoff_types::{AgentFaultKind, Phase, TimeLimits};
use faceoff_wire::{MAX_LINE_BYTES, Message, StandardOutput, answer, quote_line};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// If the last answer took less than this, the evaluator busy-polls this long for the next one, provided that this
/// costs the agent no CPU time. Sleeping and waking up takes about as long as such an answer, even from an
/// interpreted agent.
const SPIN_TIME: Duration = Duration::from_micros(100);

/// A running agent, and its current exchange.
#[derive(Debug)]
pub(crate) struct Exchange<'w> {
    process: AgentProcess,
    supervised: SupervisedAgent,
    monitor: &'w dyn InterferenceMonitor,
    /// The CPUs of the calling thread, if the agent may use none of them.
    evaluator_cpus: Option<Vec<usize>>,
    /// Did the last answer take less than [`SPIN_TIME`]?
    was_quick: bool,
    /// The counters before a recent question.
    baseline: Option<Arc<CounterBaseline>>,
    /// The message being sent; its memory is reused.
    line: Vec<u8>,
    /// CPU time of the agent at its questions and answers.
    cpu: CpuUsage,
    /// Time to exit after the agent has closed its output, so that its exit status can be reported.
    exit_grace: Duration,
}

/// A question whose answer is pending.
#[derive(Debug, Clone)]
pub(crate) struct PendingQuestion {
    phase: Phase,
    limit_s: f64,
    wait: AnswerWait,
    /// CPU time of the agent between its last answer and this question.
    early_cpu_time: Duration,
}

/// An answer of the agent.
pub(crate) struct Answer {
    pub bytes: Vec<u8>,
    /// The wait until the answer's last byte.
    pub wait: WaitBreakdown,
}

impl Answer {
    /// The error for an agent fault in this line.
    pub fn to_error(&self, fault: AgentFaultKind) -> SessionError {
        SessionError::Agent {
            fault,
            line: Some(quote_line(&self.bytes)),
        }
    }
}

impl PendingQuestion {
    /// Adds time in which the evaluator could not check for the answer, because it was busy with the other agent of a game.
    pub fn add_absence(&mut self, absence: Duration) {
        self.wait.add_absence(absence);
    }
}

impl<'w> Exchange<'w> {
    /// Starts the bundle's command.
    pub fn start(
        bundle: &Bundle,
        env: &AgentEnvironment,
        monitor: &'w dyn InterferenceMonitor,
    ) -> Result<Self, SessionError> {
        let manifest = &bundle.manifest;
        let runtime =
            find_runtime(bundle, env).map_err(|detail| AgentFaultKind::CannotStart { detail })?;
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
            logs_output: manifest.stdout == StandardOutput::Log,
            runtime,
            limits: env.limits.clone(),
            isolation: env.isolation.clone(),
            cpus: env.agent_cpus.clone(),
        })
        .map_err(|error| match error {
            SpawnError::Agent(fault) => fault.into(),
            SpawnError::Platform(error) => SessionError::from(error),
        })?;
        let evaluator_cpus = affinity::allowed_cpus().ok().filter(|cpus| {
            !env.agent_cpus.is_empty() && cpus.iter().all(|cpu| !env.agent_cpus.contains(cpu))
        });
        Ok(Self {
            supervised: SupervisedAgent::new(process.killer()?, &env.supervision),
            cpu: CpuUsage::new(process.cpu_time_s(), env),
            process,
            monitor,
            evaluator_cpus,
            was_quick: false,
            baseline: None,
            line: Vec::with_capacity(4096),
            exit_grace: TimeLimits::duration(env.time.bye_s),
        })
    }

    /// Sends a question without waiting. Writing the question and waiting for the answer share the limit `limit_s`.
    pub fn send(
        &mut self,
        message: &Message<'_>,
        phase: Phase,
        limit_s: f64,
    ) -> Result<PendingQuestion, SessionError> {
        message.write_line(&mut self.line);
        let baseline = self.read_baseline(phase);
        // From here on all time counts as the agent's, because the following calls use resources that it can affect.
        let asked_at = Instant::now();
        let limit = TimeLimits::duration(limit_s);
        let _busy = self.supervised.busy(self.latest_end(asked_at, limit));
        let sent = self.write_question(asked_at, phase);
        let question = sent.map(|early_cpu_time| PendingQuestion {
            phase,
            limit_s,
            wait: AnswerWait::begin(Some(baseline), asked_at, Instant::now(), limit),
            early_cpu_time,
        });
        self.prefer_kill_reason(question, phase, limit_s, asked_at)
    }

    /// Sends the line; returns the agent's CPU time since its last answer.
    fn write_question(
        &mut self,
        asked_at: Instant,
        phase: Phase,
    ) -> Result<Duration, SessionError> {
        self.process.thaw();
        // During start-up any output counts as the answer, because the agent runs before `hello` is sent.
        if phase != Phase::StartUp && self.process.has_pending_output()? {
            return Err(self.early_output_error(phase));
        }
        let early_cpu_time = self
            .cpu
            .record_question(asked_at, || self.process.cpu_time_s());
        match self.process.send_line(&self.line) {
            Ok(()) => Ok(early_cpu_time),
            Err(WriteError::Closed) => Err(self.closed_error()),
            Err(WriteError::Platform(error)) => Err(error.into()),
        }
    }

    /// The latest possible end of a wait, after all extensions of its limit.
    fn latest_end(&self, asked_at: Instant, limit: Duration) -> Instant {
        asked_at + limit * (1 + MAX_EXTENSION) + self.exit_grace
    }

    /// Replaces the result if the supervisor killed the agent: other errors only follow from the agent's death.
    fn prefer_kill_reason<T>(
        &self,
        result: Result<T, SessionError>,
        phase: Phase,
        limit_s: f64,
        asked_at: Instant,
    ) -> Result<T, SessionError> {
        match self.supervised.kill_reason() {
            None => result,
            Some(KillReason::Cancelled) => Err(PlatformFault::Cancelled.into()),
            Some(KillReason::Stalled) => Err(SessionError::TimedOut {
                fault: AgentFaultKind::TimedOut { phase, limit_s },
                wait: Box::new(WaitBreakdown {
                    wall: asked_at.elapsed(),
                    host_interference: Duration::ZERO,
                    early_cpu_time: Duration::ZERO,
                    cpu_time_s: None,
                }),
            }),
        }
    }

    /// The counters before a question, at most [`BASELINE_MAX_AGE`] old: reading them for each question to a quick
    /// agent would cost more than the answer. They are kernel files, so no agent can block the read.
    fn read_baseline(&mut self, phase: Phase) -> Arc<CounterBaseline> {
        if phase != Phase::Step {
            self.process.track_threads();
            self.baseline = None;
        }
        match &self.baseline {
            Some(baseline) if baseline.read_at.elapsed() < BASELINE_MAX_AGE => Arc::clone(baseline),
            _ => {
                let baseline = self.process.read_baseline(self.evaluator_cpus.as_deref());
                Arc::clone(self.baseline.insert(Arc::new(baseline)))
            }
        }
    }

    /// Freezes the agent until its next question, if the host can.
    pub fn freeze(&mut self) {
        self.process.freeze();
    }

    /// Can the host freeze the agent?
    pub fn can_freeze(&self) -> bool {
        self.process.can_freeze()
    }

    /// Waits for the answer until `deadline`, which may have passed, or until its limit has passed. `None` if the answer
    /// is still pending.
    pub fn poll(
        &mut self,
        question: &mut PendingQuestion,
        deadline: Instant,
    ) -> Result<Option<Answer>, SessionError> {
        let (phase, limit_s, asked_at) = (question.phase, question.limit_s, question.wait.asked_at);
        let latest_end = self.latest_end(asked_at, TimeLimits::duration(limit_s));
        let _busy = self.supervised.busy(latest_end);
        let result = self.read_answer(question, deadline);
        self.prefer_kill_reason(result, phase, limit_s, asked_at)
    }

    fn read_answer(
        &mut self,
        question: &mut PendingQuestion,
        deadline: Instant,
    ) -> Result<Option<Answer>, SessionError> {
        if self.evaluator_cpus.is_some() && self.was_quick {
            self.process
                .spin_until(deadline.min(question.wait.asked_at + SPIN_TIME))?;
        }
        loop {
            let next_wake = deadline.min(question.wait.wake_at);
            match self.process.read_line(MAX_LINE_BYTES, next_wake)? {
                // The question is not sent completely, so this line cannot be its answer.
                ReadLine::Line { bytes, .. }
                    if question.phase != Phase::StartUp && !self.process.is_all_sent() =>
                {
                    return Err(unsolicited_line(question.phase, &bytes));
                }
                ReadLine::Line { bytes, received_at } => {
                    return Ok(Some(self.finish_answer(question, bytes, received_at)));
                }
                ReadLine::TooLong { head } => return Err(too_long(&head)),
                ReadLine::Closed => return Err(self.closed_error()),
                ReadLine::TimedOut => {
                    question.wait.clear_absence();
                    self.check_wait(question)?;
                }
            }
            if deadline <= next_wake {
                return Ok(None);
            }
        }
    }

    /// Waits for the answer.
    pub fn wait(&mut self, question: &mut PendingQuestion) -> Result<Answer, SessionError> {
        loop {
            let deadline = Instant::now() + TimeLimits::MAX_WAIT;
            if let Some(answer) = self.poll(question, deadline)? {
                return Ok(answer);
            }
        }
    }

    /// Waits until [`Self::poll`] has something to do for one of several agents, or until `deadline`.
    pub fn wait_for_any(
        exchanges: &[(&Self, &PendingQuestion)],
        deadline: Instant,
    ) -> Result<(), PlatformFault> {
        let _busy: Vec<BusyGuard> = exchanges
            .iter()
            .map(|(exchange, question)| {
                let limit = TimeLimits::duration(question.limit_s);
                exchange
                    .supervised
                    .busy(exchange.latest_end(question.wait.asked_at, limit))
            })
            .collect();
        let processes: Vec<&AgentProcess> = exchanges
            .iter()
            .map(|(exchange, _)| &exchange.process)
            .collect();
        let deadline = exchanges.iter().fold(deadline, |earliest, (_, question)| {
            earliest.min(question.wait.wake_at)
        });
        Ok(AgentProcess::wait_for_any(&processes, deadline)?)
    }

    /// Sends a message that has no answer, without blocking. Bytes that do not fit into the agent's input cost it time
    /// at the next question. If its input is closed, the next question reports the fault.
    pub fn notify(&mut self, message: &Message<'_>) -> Result<(), PlatformFault> {
        message.write_line(&mut self.line);
        let _busy = self.supervised.busy(Instant::now() + self.exit_grace);
        match self.process.send_line(&self.line) {
            Ok(()) | Err(WriteError::Closed) => Ok(()),
            Err(WriteError::Platform(error)) => Err(error.into()),
        }
    }

    fn finish_answer(
        &mut self,
        question: &PendingQuestion,
        bytes: Vec<u8>,
        received_at: Instant,
    ) -> Answer {
        let cpu_time_s = self.process.cpu_time_s();
        let wait = self.wait_breakdown(question, received_at, cpu_time_s, AnswerState::Received);
        self.cpu.record_answer(received_at, cpu_time_s);
        self.was_quick = wait.wall < SPIN_TIME;
        Answer { bytes, wait }
    }

    /// Handles a wake-up without an answer: checks the limit and samples the counters.
    fn check_wait(&mut self, question: &mut PendingQuestion) -> Result<(), SessionError> {
        let now = Instant::now();
        if now >= question.wait.deadline {
            let cpu_time_s = self.process.cpu_time_s();
            let wait = self.wait_breakdown(question, now, cpu_time_s, AnswerState::Pending);
            let fault = AgentFaultKind::TimedOut {
                phase: question.phase,
                limit_s: question.limit_s,
            };
            let extension = question.wait.extend(now, wait.host_interference);
            let wait = Box::new(wait);
            return match extension {
                Extension::Extended => Ok(()),
                Extension::AgentTimeout => Err(SessionError::TimedOut { fault, wait }),
                Extension::HostTimeout => Err(SessionError::HostInterference { fault, wait }),
            };
        }
        let wait = &mut question.wait;
        if now >= wait.wake_at {
            if wait.is_first_sample() {
                // Includes the threads that it has started since the question.
                self.process.track_threads();
            }
            wait.add_sample(self.process.read_cpus());
            // Counted from the check above: a delay of the evaluator after the check counts as lateness.
            wait.schedule_wake(now);
        }
        Ok(())
    }

    /// Breakdown of the wait until `now`. `cpu_time_s`: the agent's CPU time so far.
    fn wait_breakdown(
        &self,
        question: &PendingQuestion,
        now: Instant,
        cpu_time_s: Option<f64>,
        answer: AnswerState,
    ) -> WaitBreakdown {
        let run_time_s = self.cpu.since_question_s(cpu_time_s);
        WaitBreakdown {
            wall: now.saturating_duration_since(question.wait.asked_at),
            host_interference: self.host_interference(&question.wait, now, run_time_s, answer),
            early_cpu_time: question.early_cpu_time,
            cpu_time_s: self.cpu.since_earlier_answer_s(cpu_time_s),
        }
    }

    fn host_interference(
        &self,
        wait: &AnswerWait,
        now: Instant,
        run_time_s: Option<f64>,
        answer: AnswerState,
    ) -> Duration {
        if !wait.is_late(now) {
            return Duration::ZERO;
        }
        let interference = self.process.interference_since(
            wait.asked_at,
            wait.samples(),
            wait.cpu_baseline(),
            answer,
        );
        let evaluator = self
            .evaluator_cpus
            .as_deref()
            .zip(wait.evaluator_baseline());
        let counters = WaitCounters {
            now,
            run_delay: interference.map(|interference| interference.run_delay),
            stolen: interference.map_or(Duration::ZERO, |interference| interference.stolen),
            agent_run_time: run_time_s.map(TimeLimits::duration),
            evaluator_run_delay: evaluator.map(|(cpus, before)| {
                self.process
                    .evaluator_counters(cpus)
                    .run_delay_since(before)
            }),
        };
        wait.interference(self.monitor, counters)
    }

    /// Gives the agent `grace` to exit, then kills it; returns its standard error (its beginning and end, if it is long).
    pub fn finish(self, grace: Duration) -> Result<String, PlatformFault> {
        let Self {
            process,
            supervised,
            ..
        } = self;
        let _busy = supervised.busy(Instant::now() + grace);
        Ok(process.finish(grace)?.stderr)
    }

    /// The error for output before the question, or for a closed output.
    fn early_output_error(&mut self, phase: Phase) -> SessionError {
        match self.process.read_line(MAX_LINE_BYTES, Instant::now()) {
            Ok(ReadLine::Line { bytes, .. }) => unsolicited_line(phase, &bytes),
            Ok(ReadLine::TimedOut) => unsolicited_output(phase).into(),
            Ok(ReadLine::TooLong { head }) => too_long(&head),
            Ok(ReadLine::Closed) => self.closed_error(),
            Err(error) => error.into(),
        }
    }

    /// The error for a closed channel: by exit, by a kill, or by the agent itself.
    fn closed_error(&mut self) -> SessionError {
        match self.process.diagnose_end(self.exit_grace) {
            Ok(end) => end.unwrap_or(AgentFaultKind::ClosedOutput).into(),
            Err(error) => error.into(),
        }
    }
}

/// The agent's runtime: its image, or the runtime that its manifest names. The error says why it is not available.
fn find_runtime(bundle: &Bundle, env: &AgentEnvironment) -> Result<Runtime, String> {
    let name = &bundle.manifest.runtime;
    if let Some(image) = &bundle.image {
        if !env.isolation.enforces(Layer::Namespaces) {
            return Err(
                "the agent is a container image, which runs in the sandbox only, and the layer namespaces is disabled here"
                    .to_owned(),
            );
        }
        if env.images {
            return Ok(Runtime::from_image(&image.root, image.path()));
        }
    } else if let Some(runtime) = env.runtimes.get(name) {
        return Ok(runtime.clone());
    }
    Err(format!(
        "the runtime {name:?} of agent.toml is not offered here; offered: {}",
        env.runtime_names().join(", ")
    ))
}

fn too_long(head: &[u8]) -> SessionError {
    SessionError::Agent {
        fault: answer::too_long(),
        line: Some(quote_line(head)),
    }
}

fn unsolicited_output(phase: Phase) -> AgentFaultKind {
    AgentFaultKind::WrongMessage {
        expected: format!("no output before the next question ({phase})"),
        got: "a line that was not asked for".to_owned(),
    }
}

fn unsolicited_line(phase: Phase, line: &[u8]) -> SessionError {
    SessionError::Agent {
        fault: unsolicited_output(phase),
        line: Some(quote_line(line)),
    }
}
