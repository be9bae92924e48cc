use crate::{
    AgentEnvironment, PlatformFault, Session, Trouble,
    bundle::Bundle,
    log::Log,
    recording::{EpisodeStart, StepRow, StepSink},
};
use faceoff_sim::{Episode, Interpolation, PerturbationSettings, Plant};
use faceoff_types::{
    AgentFault, AgentFaultKind, ComputationTime, EpisodeEnd, EpisodeOutcome, Factor, Profile, Seed,
    Task,
};

/// Plays episodes of one task with one agent, which is restarted after a fault.
#[derive(Debug)]
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
        }
    }

    /// Plays one episode of at most `max_steps` control steps.
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
        let start_up = match self.session {
            Some(_) => None,
            None => self.start()?,
        };
        // Without an agent the initial state is still of interest; it is the same for all.
        let interpolation = self.session.as_ref().map(Session::interpolation);
        let code = interpolation.map_or(Some(3), |code| code.code());
        let interpolation_of_sim = Interpolation::from_code(code).ok_or_else(|| {
            PlatformFault::Recording(format!("the simulator lacks interpolation {code:?}"))
        })?;
        let seed = self.seed.episode(self.task, episode);
        let mut world = Episode::new(
            self.task,
            interpolation_of_sim,
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
            sink.end(&outcome)?;
            return Ok(outcome);
        }

        let mut times = Times::default();
        let outcome =
            match self.converse(episode, max_steps, &mut world, &mut times, sink, cancelled) {
                Ok(end) => EpisodeOutcome {
                    task: self.task,
                    episode,
                    steps: world.steps(),
                    end,
                    success: world.success(),
                    violations: world.violations(),
                    computation_time: times.summary(),
                    fault: None,
                },
                Err((_, Trouble::Platform(fault))) => return Err(fault),
                Err((step, Trouble::Agent { fault, line })) => {
                    let fault = Fault { kind: fault, line };
                    self.failed(&world, episode, Some(episode), step, fault, times)
                }
            };
        sink.end(&outcome)?;
        Ok(outcome)
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
            times.add(answered.computation_time_s);
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

/// Computation times of one episode.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Times {
    sum_s: f64,
    max_s: f64,
    count: u32,
}

impl Times {
    pub fn add(&mut self, time_s: f64) {
        self.sum_s += time_s;
        self.max_s = self.max_s.max(time_s);
        self.count += 1;
    }

    pub fn summary(self) -> ComputationTime {
        let mean_s = if self.count == 0 {
            0.0
        } else {
            self.sum_s / f64::from(self.count)
        };
        ComputationTime {
            mean_s,
            max_s: self.max_s,
        }
    }
}
