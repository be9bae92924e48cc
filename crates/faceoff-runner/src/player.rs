use crate::{
    AgentEnvironment, HostWatch, PlatformFault, Session, Trouble,
    bundle::Bundle,
    host_noise::{Late, Times},
    log::Log,
};
use faceoff_episode::{EpisodeStart, StepRow, StepSink};
use faceoff_sim::{Episode, PerturbationSettings, Plant};
use faceoff_types::{
    AgentFault, AgentFaultKind, EpisodeEnd, EpisodeOutcome, Factor, Interpolation, Profile, Seed,
    Task,
};

/// Plays episodes of one task with one agent, which is restarted after a fault. An episode that the
/// host's stalls cost the agent is played again.
pub(crate) struct Player<'a> {
    bundle: &'a Bundle,
    env: &'a AgentEnvironment,
    task: Task,
    profile: Profile,
    seed: Seed,
    settings: PerturbationSettings,
    plant: Plant,
    session: Option<Session>,
    log: Log,
    action: Vec<f64>,
    watch: &'a dyn HostWatch,
    host_noise_reruns: u32,
}

/// One try of an episode.
struct Try {
    outcome: EpisodeOutcome,
    /// Did the host's stalls cost the agent points, or the episode?
    spoilt_by_host: bool,
}

/// The agent's fault, before it is known where it counts.
struct Fault {
    kind: AgentFaultKind,
    line: Option<String>,
}

impl<'a> Player<'a> {
    /// Prepares the plant; the agent is started by the first episode.
    pub fn new(
        bundle: &'a Bundle,
        env: &'a AgentEnvironment,
        task: Task,
        profile: Profile,
        seed: Seed,
        mismatch_seed: Seed,
        watch: &'a dyn HostWatch,
    ) -> Self {
        let settings = PerturbationSettings::default();
        let plant = if profile.factors().contains(Factor::ModelMismatch) {
            Plant::mismatched(&settings, mismatch_seed)
        } else {
            Plant::nominal()
        };
        Self {
            bundle,
            env,
            task,
            profile,
            seed,
            settings,
            plant,
            session: None,
            log: Log::new(env.limits.stderr_tail_bytes),
            action: Vec::new(),
            watch,
            host_noise_reruns: 0,
        }
    }

    /// Tries that were dropped so far because the host stalled.
    pub const fn host_noise_reruns(&self) -> u32 {
        self.host_noise_reruns
    }

    /// Plays one episode of at most `max_steps` control steps, again while the host spoils it and the
    /// limit of re-runs allows; the last try counts.
    ///
    /// # Errors
    /// The platform's alone; an agent's fault is an outcome. `cancelled` is asked before each step.
    pub fn play(
        &mut self,
        episode: u32,
        max_steps: u32,
        sink: &mut dyn StepSink,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeOutcome, PlatformFault> {
        let mut reruns = 0;
        loop {
            let Try {
                outcome,
                spoilt_by_host,
            } = self.attempt(episode, max_steps, sink, cancelled)?;
            if spoilt_by_host && reruns < self.env.time.host_noise_reruns {
                reruns += 1;
                self.host_noise_reruns += 1;
                tracing::warn!(task = %self.task, episode, reruns, "the host stalled: the episode is played again");
                if outcome.fault.is_some() {
                    self.log.add(
                        "",
                        Some("not counted: the host stalled, and the episode is played again"),
                    );
                }
                continue;
            }
            sink.end(&outcome, reruns)?;
            return Ok(outcome);
        }
    }

    fn attempt(
        &mut self,
        episode: u32,
        max_steps: u32,
        sink: &mut dyn StepSink,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Try, PlatformFault> {
        let start_up = match self.session {
            Some(_) => None,
            None => self.start()?,
        };
        // Without an agent the initial state is still of interest; it is the same for all.
        let interpolation = self.session.as_ref().map(Session::interpolation);
        let seed = self.seed.episode(self.task, episode);
        let mut world = Episode::new(
            self.task,
            interpolation.unwrap_or(Interpolation::Cubic),
            self.profile.factors(),
            &self.settings,
            &self.plant,
            seed,
        );
        sink.begin(EpisodeStart {
            episode,
            seed,
            interpolation,
            state: &world.state(),
        });
        if let Some(fault) = start_up {
            let outcome = self.failed(&world, episode, None, None, fault, Times::default());
            return Ok(Try {
                outcome,
                spoilt_by_host: false,
            });
        }

        let mut times = Times::default();
        match self.converse(episode, max_steps, &mut world, &mut times, sink, cancelled) {
            Ok(end) => Ok(Try {
                spoilt_by_host: times.host_cost_points(),
                outcome: EpisodeOutcome {
                    task: self.task,
                    episode,
                    steps: world.steps(),
                    end,
                    success: world.success(),
                    violations: world.violations(),
                    computation_time: times.summary(),
                    fault: None,
                },
            }),
            Err((_, Trouble::Platform(fault))) => Err(fault),
            Err((step, Trouble::Agent { fault, line })) => {
                let spoilt_by_host = step.is_some() && self.is_kept_from_answering(&fault);
                let fault = Fault { kind: fault, line };
                Ok(Try {
                    outcome: self.failed(&world, episode, Some(episode), step, fault, times),
                    spoilt_by_host,
                })
            }
        }
    }

    /// Was it the host's stall that made a step's hard limit pass?
    fn is_kept_from_answering(&mut self, fault: &AgentFaultKind) -> bool {
        let AgentFaultKind::TimedOut { limit_s, .. } = fault else {
            return false;
        };
        let Some(session) = &mut self.session else {
            return false;
        };
        let Some((asked, until)) = session.waited() else {
            return false;
        };
        let late = Late {
            wall_s: (until - asked).as_secs_f64(),
            cpu_s: session.cpu_time_since_answer_s(),
            stalled_s: self.watch.stalled_s(asked, until),
        };
        late.no_answer_is_noise(*limit_s)
    }

    /// Says goodbye to the agent and returns the log of all its processes.
    pub fn close(mut self) -> Result<String, PlatformFault> {
        if let Some(session) = self.session.take() {
            let stderr = session.finish()?;
            self.log.add(&stderr, None);
        }
        Ok(self.log.into_text())
    }

    /// Ends the agent at once and returns the log of all its processes.
    pub fn abort(mut self) -> String {
        if let Some(session) = self.session.take() {
            self.log.add(&session.abort(), None);
        }
        self.log.into_text()
    }

    fn start(&mut self) -> Result<Option<Fault>, PlatformFault> {
        match Session::start(self.bundle, self.env, self.task) {
            Ok(session) => {
                self.session = Some(session);
                Ok(None)
            }
            Err((Trouble::Platform(fault), _)) => Err(fault),
            Err((Trouble::Agent { fault, line }, stderr)) => {
                self.log.add(&stderr, None);
                Ok(Some(Fault { kind: fault, line }))
            }
        }
    }

    /// The conversation of one episode; trouble comes with the step at which it arose, none for
    /// `reset`.
    fn converse(
        &mut self,
        episode: u32,
        max_steps: u32,
        world: &mut Episode,
        times: &mut Times,
        sink: &mut dyn StepSink,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<EpisodeEnd, (Option<u32>, Trouble)> {
        let session = self.session.as_mut().expect("a session was started");
        session.reset(episode).map_err(|trouble| (None, trouble))?;
        let end = loop {
            let step = world.steps();
            let at_step = |trouble| (Some(step), trouble);
            if cancelled() {
                return Err(at_step(Trouble::Platform(PlatformFault::Cancelled)));
            }
            let answered = session
                .step(step, world.observation(), &mut self.action)
                .map_err(at_step)?;
            let wall_s = answered.computation_time_s;
            let without_noise_s = match session.waited() {
                Some((asked, until)) if Late::is_late(wall_s) => Late {
                    wall_s,
                    cpu_s: answered.cpu_time_s,
                    stalled_s: self.watch.stalled_s(asked, until),
                }
                .without_noise_s(),
                _ => wall_s,
            };
            times.add(wall_s, without_noise_s);
            sink.observe(world.observation());
            let outcome = world.step(&self.action);
            sink.step(&StepRow {
                step,
                action: &self.action,
                answered,
                state: &world.state(),
                constraints: outcome.constraints,
                next_observation: world.observation(),
            });
            if let Some(end) = outcome.end {
                break end;
            }
            if world.steps() >= max_steps {
                break EpisodeEnd::Horizon;
            }
        };
        let steps = world.steps();
        session
            .end(episode, steps)
            .map_err(|fault| (Some(steps), Trouble::Platform(fault)))?;
        Ok(end)
    }

    /// Ends the agent and makes its fault the episode's outcome.
    fn failed(
        &mut self,
        world: &Episode,
        episode: u32,
        fault_episode: Option<u32>,
        step: Option<u32>,
        fault: Fault,
        times: Times,
    ) -> EpisodeOutcome {
        let fault = AgentFault {
            fault: fault.kind,
            task: self.task,
            episode: fault_episode,
            step,
            line: fault.line,
        };
        let stderr = self.session.take().map(Session::abort).unwrap_or_default();
        self.log.add(&stderr, Some(&fault.to_string()));
        EpisodeOutcome {
            task: self.task,
            episode,
            steps: world.steps(),
            end: EpisodeEnd::AgentFault,
            success: false,
            violations: world.violations(),
            computation_time: times.summary(),
            fault: Some(fault),
        }
    }
}
