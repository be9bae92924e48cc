//! A *session*: one run of an agent's process and the protocol with it, from `hello` to `bye`.

use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    exchange::{Answer, Exchange, PendingQuestion},
    fault::{PlatformFault, SessionError},
    host_interference::{InterferenceMonitor, KernelCounters},
};
use faceoff_episode::AnswerTiming;
use faceoff_types::{ActionLayout, AgentFaultKind, AgentTask, Phase, TimeLimits};
use faceoff_wire::{Message, answer};
use serde_json::value::RawValue;
use std::time::{Duration, Instant};

/// An agent process and the protocol session with it. Every wait has a deadline. Dropping it kills
/// the process tree.
///
/// [`Self::reset`] and [`Self::step`] send a question and wait. With two agents, send to both with `send_…`, then
/// alternate between [`Self::wait_for_any`] and [`Self::poll`] on each.
#[derive(Debug)]
pub struct Session<'w> {
    exchange: Exchange<'w>,
    time: TimeLimits,
    layout: ActionLayout,
    startup_s: f64,
    pending: Option<SentQuestion>,
    /// The last action; its memory is reused.
    action: Vec<f64>,
}

/// The question that was sent last, until its answer arrives.
#[derive(Debug, Clone)]
struct SentQuestion {
    question: Question,
    /// Its limit, and the measurement of the wait for its answer.
    pending_question: PendingQuestion,
}

#[derive(Debug, Clone, Copy)]
enum Question {
    Reset { episode: u32 },
    Step { step: u32 },
}

impl Session<'static> {
    /// Starts the bundle's command and exchanges `hello` and `ready`.
    ///
    /// # Errors
    /// The failure, and the agent's standard error (its beginning and end, if it is long).
    pub fn start(
        bundle: &Bundle,
        environment: &AgentEnvironment,
        agent_task: AgentTask,
    ) -> Result<Self, (SessionError, String)> {
        Self::start_monitored(bundle, environment, agent_task, &KernelCounters)
    }
}

impl<'w> Session<'w> {
    /// [`Session::start`] with another monitor of host interference.
    pub(crate) fn start_monitored(
        bundle: &Bundle,
        environment: &AgentEnvironment,
        agent_task: AgentTask,
        monitor: &'w dyn InterferenceMonitor,
    ) -> Result<Self, (SessionError, String)> {
        let mut exchange = Exchange::start(bundle, environment, monitor)
            .map_err(|error| (error, String::new()))?;
        let stated_interpolation = bundle.manifest.interpolation;
        match exchange_hello(&mut exchange, agent_task, stated_interpolation, environment) {
            Ok((layout, startup_s)) => Ok(Self {
                exchange,
                time: environment.time.clone(),
                layout,
                startup_s,
                pending: None,
                action: Vec::new(),
            }),
            Err(error) => Err((error, abort(exchange))),
        }
    }

    /// Layout of the agent's actions.
    #[must_use]
    pub const fn layout(&self) -> ActionLayout {
        self.layout
    }

    /// Start-up time of the agent, without host interference, in seconds.
    #[must_use]
    pub const fn startup_s(&self) -> f64 {
        self.startup_s
    }

    /// Announces an episode and waits until the agent is ready.
    ///
    /// # Errors
    /// An agent fault or a platform fault.
    pub fn reset(&mut self, episode: u32) -> Result<AnswerTiming, SessionError> {
        self.send_reset(episode)?;
        self.wait()
    }

    /// Requests the action of a step and waits for it.
    ///
    /// # Errors
    /// An agent fault or a platform fault.
    pub fn step(&mut self, step: u32, observation: &[f64]) -> Result<AnswerTiming, SessionError> {
        self.send_step(step, observation)?;
        self.wait()
    }

    /// The last action, row-major, with the length that the layout requires.
    #[must_use]
    pub fn action(&self) -> &[f64] {
        &self.action
    }

    /// Announces an episode, or a rally of a game, without waiting.
    ///
    /// # Errors
    /// An agent fault or a platform fault.
    pub fn send_reset(&mut self, episode: u32) -> Result<(), SessionError> {
        self.send(Question::Reset { episode }, &Message::Reset { episode })
    }

    /// Requests the action of a step, without waiting; the observation must be finite.
    ///
    /// # Errors
    /// An agent fault or a platform fault.
    pub fn send_step(&mut self, step: u32, observation: &[f64]) -> Result<(), SessionError> {
        debug_assert!(observation.iter().all(|value| value.is_finite()));
        self.send(Question::Step { step }, &Message::step(step, observation))
    }

    fn send(&mut self, question: Question, message: &Message<'_>) -> Result<(), SessionError> {
        let (phase, limit_s) = match question {
            Question::Reset { .. } => (Phase::Reset, self.time.reset_s),
            Question::Step { .. } => (Phase::Step, self.time.step_s),
        };
        self.pending = None;
        let pending_question = self.exchange.send(message, phase, limit_s)?;
        self.pending = Some(SentQuestion {
            question,
            pending_question,
        });
        Ok(())
    }

    /// Adds time in which the evaluator was busy with another agent and did not check for the pending answer. The agent is not
    /// charged for it if its answer is available at the next check.
    pub fn add_absence(&mut self, absence: Duration) {
        if let Some(pending) = &mut self.pending {
            pending.pending_question.add_absence(absence);
        }
    }

    /// Freezes the agent until its next question, if the host can.
    pub fn freeze(&mut self) {
        self.exchange.freeze();
    }

    /// Can the host freeze the agent?
    #[must_use]
    pub fn can_freeze(&self) -> bool {
        self.exchange.can_freeze()
    }

    /// Is an answer pending?
    #[must_use]
    pub const fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// Waits until one of the agents with a pending answer has written output or reached its limit, or until `deadline`.
    /// [`Self::poll`] with an expired deadline then returns the result, if any.
    ///
    /// # Errors
    /// Platform faults only.
    pub fn wait_for_any(sessions: &[&Self], deadline: Instant) -> Result<(), PlatformFault> {
        let pending: Vec<_> = sessions
            .iter()
            .filter_map(|session| {
                Some((
                    &session.exchange,
                    &session.pending.as_ref()?.pending_question,
                ))
            })
            .collect();
        Exchange::wait_for_any(&pending, deadline)
    }

    /// Waits for the pending answer until `deadline`, which may have passed, and takes it; an action is then in
    /// [`Self::action`]. `None` if the answer has not arrived, or none is pending.
    ///
    /// # Errors
    /// An agent fault, e.g. a timeout, or a platform fault.
    pub fn poll(&mut self, deadline: Instant) -> Result<Option<AnswerTiming>, SessionError> {
        let Some(SentQuestion {
            question,
            mut pending_question,
        }) = self.pending.take()
        else {
            return Ok(None);
        };
        match self.exchange.poll(&mut pending_question, deadline)? {
            Some(answer) => self.parse_answer(question, &answer).map(Some),
            None => {
                self.pending = Some(SentQuestion {
                    question,
                    pending_question,
                });
                Ok(None)
            }
        }
    }

    /// Waits for the pending answer until its limit.
    fn wait(&mut self) -> Result<AnswerTiming, SessionError> {
        loop {
            if let Some(answered) = self.poll(Instant::now() + TimeLimits::MAX_WAIT)? {
                return Ok(answered);
            }
        }
    }

    fn parse_answer(
        &mut self,
        question: Question,
        answer: &Answer,
    ) -> Result<AnswerTiming, SessionError> {
        match question {
            Question::Reset { episode } => answer::parse_reset_ready(&answer.bytes, episode),
            Question::Step { step } => {
                answer::parse_act(&answer.bytes, step, self.layout, &mut self.action)
            }
        }
        .map_err(|fault| answer.to_error(fault))?;
        let wait = &answer.wait;
        Ok(AnswerTiming {
            computation_time_s: wait.agent_time().as_secs_f64(),
            host_time_s: wait.host_interference.as_secs_f64(),
            cpu_time_s: wait.cpu_time_s,
        })
    }

    /// Sends the end of an episode or rally. If the agent's input is closed, the next question reports the fault.
    ///
    /// # Errors
    /// Platform faults only.
    pub fn end(&mut self, episode: u32, steps: u32) -> Result<(), PlatformFault> {
        let end = Message::End { episode, steps };
        self.exchange.notify(&end)
    }

    /// Sends `bye`, waits for the exit, kills the remaining processes, and returns the agent's standard error (its
    /// beginning and end, if it is long).
    ///
    /// # Errors
    /// Platform faults only: the agent's exit status does not matter any more.
    pub fn finish(mut self) -> Result<String, PlatformFault> {
        self.exchange.notify(&Message::Bye)?;
        self.exchange.finish(TimeLimits::duration(self.time.bye_s))
    }

    /// Kills the agent and returns its standard error (its beginning and end, if it is long).
    pub fn abort(self) -> String {
        abort(self.exchange)
    }
}

/// Exchanges `hello` and `ready`; returns the layout of the agent's actions and the start-up time in seconds. `stated_interpolation`:
/// the one in `agent.toml`.
fn exchange_hello(
    exchange: &mut Exchange<'_>,
    agent_task: AgentTask,
    stated_interpolation: Option<i64>,
    environment: &AgentEnvironment,
) -> Result<(ActionLayout, f64), SessionError> {
    let constants = environment.simulator.hello_env(agent_task)?;
    if constants.contains(['\n', '\r']) {
        let problem = "hello's field env has several lines".to_owned();
        return Err(PlatformFault::Simulator(problem).into());
    }
    let constants = RawValue::from_string(constants).map_err(|error| {
        PlatformFault::Simulator(format!("hello's field env is not JSON: {error}"))
    })?;
    let hello = Message::hello(agent_task, &constants);
    // The agent's time begins when its sandbox exists; the set-up is the platform's time.
    let mut sent = exchange.send(&hello, Phase::StartUp, environment.time.startup_s)?;
    let answer = exchange.wait(&mut sent)?;
    let actions = &environment.simulator.competition().actions;
    let ready =
        answer::parse_ready(&answer.bytes, actions).map_err(|fault| answer.to_error(fault))?;
    match stated_interpolation {
        Some(stated) if actions.agents_choose_layout && ready.layout.code() != Some(stated) => {
            Err(answer.to_error(AgentFaultKind::WrongMessage {
                expected: format!("ready with interpolation {stated}, as agent.toml says"),
                got: format!("ready with interpolation {}", ready.layout),
            }))
        }
        _ => Ok((ready.layout, answer.wait.agent_time().as_secs_f64())),
    }
}

fn abort(exchange: Exchange<'_>) -> String {
    exchange.finish(Duration::ZERO).unwrap_or_else(|error| {
        tracing::error!(%error, "an agent's end could not be observed");
        String::new()
    })
}
