use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    exchange::{Answer, Exchange, Sent},
    fault::{PlatformFault, Trouble},
    host_watch::{Counters, HostWatch},
    wire_env::wire_env,
};
use faceoff_episode::Answered;
use faceoff_types::{AgentFaultKind, Contest, Interpolation, Phase, TimeLimits};
use faceoff_wire::{Message, answer};
use std::time::{Duration, Instant};

/// One agent process and the conversation with it. Every wait has a deadline. Dropping it kills
/// the process tree.
///
/// [`Self::reset`] and [`Self::step`] ask and wait. Who has two agents asks both with `send_…` and
/// then, in turns, waits for any and looks at each with [`Self::poll`].
#[derive(Debug)]
pub struct Session<'w> {
    exchange: Exchange<'w>,
    time: TimeLimits,
    interpolation: Interpolation,
    startup_s: f64,
    asked: Option<Asked>,
    /// The last action; its memory is reused.
    action: Vec<f64>,
}

/// A question whose answer is due.
#[derive(Debug, Clone)]
struct Asked {
    question: Question,
    sent: Sent,
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
    /// What went wrong, and what the agent had written to standard error.
    pub fn start(
        bundle: &Bundle,
        env: &AgentEnvironment,
        contest: Contest,
    ) -> Result<Self, (Trouble, String)> {
        Self::start_watched(bundle, env, contest, &Counters)
    }
}

impl<'w> Session<'w> {
    /// [`Session::start`] with another judge of what the host takes.
    pub(crate) fn start_watched(
        bundle: &Bundle,
        env: &AgentEnvironment,
        contest: Contest,
        watch: &'w dyn HostWatch,
    ) -> Result<Self, (Trouble, String)> {
        let mut exchange =
            Exchange::start(bundle, env, watch).map_err(|trouble| (trouble, String::new()))?;
        let stated = bundle.manifest.interpolation;
        match hello(&mut exchange, contest, stated, env.time.startup_s) {
            Ok((interpolation, startup_s)) => Ok(Self {
                exchange,
                time: env.time.clone(),
                interpolation,
                startup_s,
                asked: None,
                action: Vec::new(),
            }),
            Err(trouble) => Err((trouble, abort(exchange))),
        }
    }

    /// What the agent's actions mean.
    #[must_use]
    pub const fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// How long the agent took to start, less what the host took, in seconds.
    #[must_use]
    pub const fn startup_s(&self) -> f64 {
        self.startup_s
    }

    /// Announces an episode and waits until the agent is ready.
    ///
    /// # Errors
    /// The agent's fault or the platform's.
    pub fn reset(&mut self, episode: u32) -> Result<Answered, Trouble> {
        self.send_reset(episode)?;
        self.wait()
    }

    /// Asks for the action of a step and waits for it.
    ///
    /// # Errors
    /// The agent's fault or the platform's.
    pub fn step(&mut self, step: u32, observation: &[f64]) -> Result<Answered, Trouble> {
        self.send_step(step, observation)?;
        self.wait()
    }

    /// The last action: row-major, of the agreed interpolation's length.
    #[must_use]
    pub fn action(&self) -> &[f64] {
        &self.action
    }

    /// Announces an episode.
    ///
    /// # Errors
    /// The agent's fault or the platform's.
    pub fn send_reset(&mut self, episode: u32) -> Result<(), Trouble> {
        self.send(Question::Reset { episode }, &Message::Reset { episode })
    }

    /// Asks for the action of a step; the observation must be finite.
    ///
    /// # Errors
    /// The agent's fault or the platform's.
    pub fn send_step(&mut self, step: u32, observation: &[f64]) -> Result<(), Trouble> {
        debug_assert!(observation.iter().all(|value| value.is_finite()));
        self.send(Question::Step { step }, &Message::step(step, observation))
    }

    fn send(&mut self, question: Question, message: &Message<'_>) -> Result<(), Trouble> {
        let (phase, limit_s) = match question {
            Question::Reset { .. } => (Phase::Reset, self.time.reset_s),
            Question::Step { .. } => (Phase::Step, self.time.step_s),
        };
        self.asked = None;
        let sent = self.exchange.send(message, phase, limit_s)?;
        self.asked = Some(Asked { question, sent });
        Ok(())
    }

    /// Nobody looked for the answer that is due for so long, since something of ours was seen to: the agent
    /// is not charged for it if its answer is there at the next look.
    pub fn was_not_looked_at(&mut self, away: Duration) {
        if let Some(asked) = &mut self.asked {
            asked.sent.was_away(away);
        }
    }

    /// Stops the agent until it is asked again, where the host has something that does.
    pub fn freeze(&mut self) {
        self.exchange.freeze();
    }

    /// Does the host have something that stops the agent until it is asked again?
    #[must_use]
    pub fn can_freeze(&self) -> bool {
        self.exchange.can_freeze()
    }

    /// Is an answer due?
    #[must_use]
    pub const fn is_asked(&self) -> bool {
        self.asked.is_some()
    }

    /// Waits until one of the agents whose answer is due has written something or has met its limit,
    /// or until `until`. [`Self::poll`] with a time that has passed tells what it was, if anything.
    ///
    /// # Errors
    /// The platform's alone.
    pub fn wait_for_any(sessions: &[&Self], until: Instant) -> Result<(), PlatformFault> {
        let due: Vec<_> = sessions
            .iter()
            .filter_map(|session| Some((&session.exchange, &session.asked.as_ref()?.sent)))
            .collect();
        Exchange::wait_for_any(&due, until)
    }

    /// Waits for the answer that is due, at most until `until`, which may have passed, and takes it;
    /// an action is then in [`Self::action`]. `None` while it has not come, and when none is due.
    ///
    /// # Errors
    /// The agent's fault, which may be that its time is over, or the platform's.
    pub fn poll(&mut self, until: Instant) -> Result<Option<Answered>, Trouble> {
        let Some(Asked { question, mut sent }) = self.asked.take() else {
            return Ok(None);
        };
        match self.exchange.poll(&mut sent, until)? {
            Some(answer) => self.take(question, &answer).map(Some),
            None => {
                self.asked = Some(Asked { question, sent });
                Ok(None)
            }
        }
    }

    /// Waits for the answer that is due as long as its limit allows.
    fn wait(&mut self) -> Result<Answered, Trouble> {
        loop {
            if let Some(answered) = self.poll(Instant::now() + TimeLimits::LONGEST)? {
                return Ok(answered);
            }
        }
    }

    fn take(&mut self, question: Question, answer: &Answer) -> Result<Answered, Trouble> {
        match question {
            Question::Reset { episode } => answer::parse_reset_ready(&answer.bytes, episode),
            Question::Step { step } => {
                answer::parse_act(&answer.bytes, step, self.interpolation, &mut self.action)
            }
        }
        .map_err(|fault| answer.shows(fault))?;
        let waited = &answer.waited;
        Ok(Answered {
            computation_time_s: waited.of_the_agent().as_secs_f64(),
            host_time_s: waited.host.as_secs_f64(),
            cpu_time_s: waited.cpu_time_s,
        })
    }

    /// Tells that an episode is over. An agent that no longer listens meets its fault at the next
    /// question.
    ///
    /// # Errors
    /// The platform's alone.
    pub fn end(&mut self, episode: u32, steps: u32) -> Result<(), PlatformFault> {
        let end = Message::End { episode, steps };
        self.exchange.tell(&end)
    }

    /// Says goodbye, waits for the exit, kills what is left, and returns the end of the agent's
    /// standard error.
    ///
    /// # Errors
    /// The platform's alone: how an agent exits is its own affair by now.
    pub fn finish(mut self) -> Result<String, PlatformFault> {
        self.exchange.tell(&Message::Bye)?;
        self.exchange.finish(TimeLimits::duration(self.time.bye_s))
    }

    /// Kills the agent and returns the end of its standard error.
    pub fn abort(self) -> String {
        abort(self.exchange)
    }
}

/// What the agent's first answer says, and how long that took; `stated` is the interpolation that `agent.toml` promises.
fn hello(
    exchange: &mut Exchange<'_>,
    contest: Contest,
    stated: Option<i64>,
    limit_s: f64,
) -> Result<(Interpolation, f64), Trouble> {
    let hello = Message::hello(contest, wire_env(contest));
    // Its time begins when its sandbox stands: what that took was ours.
    let mut sent = exchange.send(&hello, Phase::StartUp, limit_s)?;
    let answer = exchange.wait(&mut sent)?;
    let ready = answer::parse_ready(&answer.bytes).map_err(|fault| answer.shows(fault))?;
    match stated {
        Some(stated) if ready.interpolation.code() != Some(stated) => {
            Err(answer.shows(AgentFaultKind::WrongMessage {
                expected: format!("ready with interpolation {stated}, as agent.toml says"),
                got: format!("ready with interpolation {}", ready.interpolation),
            }))
        }
        _ => Ok((
            ready.interpolation,
            answer.waited.of_the_agent().as_secs_f64(),
        )),
    }
}

fn abort(exchange: Exchange<'_>) -> String {
    exchange.finish(Duration::ZERO).unwrap_or_else(|error| {
        tracing::error!(%error, "an agent's end could not be observed");
        String::new()
    })
}
