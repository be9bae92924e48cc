//! A *game* between two agents, the *sides*, control step by control step. It is a sequence of rallies; a *rally* lasts from a serve
//! to a goal, a foul or another end.

use crate::{
    game_record::{
        Effect, GameSink, GameStepRow, RallyEnding, RallyReadiness, RallyRow, RallyStart, Response,
        SideFault, SideStep,
    },
    running_side::RunningSide,
    simulation_setup::SimulationSetup,
};
use faceoff_episode::{ActionRequest, NonFiniteObservation, RecordError};
use faceoff_sim::{Command, Divergence, Game, Interpolation};
use faceoff_types::{
    AgentFault, AgentFaultKind, AgentTask, GameEnd, GameLimits, GameOutcome, Phase, Side,
    WINDOW_STEPS,
};

/// A running game. It provides the observations for each side, takes their responses and computes the effects. The caller
/// provides the responses, from two processes or from a recording:
///
/// ```
/// # use faceoff_airhockey::{SimulationSetup, RallyReadiness, RunningGame, Response};
/// # use faceoff_episode::{AnswerTiming, NullSink};
/// # use faceoff_sim::AirHockeyProfile;
/// # use faceoff_sim::Interpolation;
/// # use faceoff_types::{GameEnd, GameLimits, Seed, Side};
/// # let seed = Seed::from_number(1);
/// # let timing = AnswerTiming { computation_time_s: 0.001, host_time_s: 0.0, cpu_time_s: None };
/// let setup = SimulationSetup::new(AirHockeyProfile::Ideal, seed, seed.model_mismatch());
/// let mut game = RunningGame::begin(&setup, 900, GameLimits::default(), NullSink);
/// while game.end().is_none() {
///     game.start_rally(Side::BOTH.map(|side| RallyReadiness::Ready {
///         startup_s: game.needs_start(side).then_some(0.1),
///         interpolation: Interpolation::Linear,
///         reset_s: 0.001,
///     }))?;
///     while game.is_in_rally() {
///         let actions = Side::BOTH.map(|side| match game.action_request(side) {
///             Ok(Some(request)) => request.observation[6..13].to_vec(),
///             other => panic!("{other:?}"),
///         });
///         let [a, b] = &actions;
///         game.answer([a, b].map(|action| Response::Answer { action, timing }))?;
///     }
/// }
/// let played = game.finish();
/// assert_eq!((played.outcome.steps, played.outcome.end), (900, GameEnd::Played));
/// # Ok::<(), faceoff_episode::RecordError>(())
/// ```
///
/// A control step takes the responses of both sides together, so their order in time has no influence.
#[derive(Debug)]
pub struct RunningGame<S> {
    game: Game,
    /// Number of control steps of the whole game.
    planned_steps: u32,
    limits: GameLimits,
    sides: [RunningSide; 2],
    /// The current rally; `None` between rallies.
    rally: Option<CurrentRally>,
    /// Number of rallies started so far.
    rallies: u32,
    end: Option<GameEnd>,
    sink: S,
}

#[derive(Debug, Clone, Copy)]
struct CurrentRally {
    number: u32,
    steps: u32,
}

/// The outcome of a finished game.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishedGame<S> {
    /// The data for scoring, except for the times of the individual answers.
    pub outcome: GameOutcome,
    /// Computation times of each side's answers, in order of play, in seconds.
    pub answer_times_s: [Vec<f64>; 2],
    /// The sink of the game.
    pub sink: S,
}

impl<S: GameSink> RunningGame<S> {
    /// A game of `steps` control steps before its first rally; the setup's seed is the game's.
    pub fn begin(setup: &SimulationSetup, steps: u32, limits: GameLimits, sink: S) -> Self {
        Self {
            // The interpolation is set before each rally.
            game: setup.game([Interpolation::Cubic; 2]),
            planned_steps: steps,
            limits,
            sides: Side::BOTH.map(RunningSide::new),
            rally: None,
            rallies: 0,
            end: None,
            sink,
        }
    }

    /// Must this side's agent be started before the next rally? True at the beginning and after each fault.
    pub fn needs_start(&self, side: Side) -> bool {
        self.sides[side.index()].needs_start()
    }

    /// Number of the current or next rally, from 0.
    pub fn rally(&self) -> u32 {
        self.rally.map_or(self.rallies, |rally| rally.number)
    }

    /// Control steps of the current rally; 0 between rallies.
    pub fn rally_steps(&self) -> u32 {
        self.rally.map_or(0, |rally| rally.steps)
    }

    /// Is the game in a rally (not between rallies)?
    pub const fn is_in_rally(&self) -> bool {
        self.rally.is_some()
    }

    /// How the game ended; `None` while it is running.
    pub const fn end(&self) -> Option<&GameEnd> {
        self.end.as_ref()
    }

    /// The side's fault in the current rally, or in the last one.
    pub const fn fault(&self, side: Side) -> Option<&AgentFault> {
        self.sides[side.index()].fault()
    }

    /// The sink of the game.
    pub const fn sink(&mut self) -> &mut S {
        &mut self.sink
    }

    /// Starts the next rally. If a side has exceeded its allowed faults or time while getting ready, the rally and the game
    /// end at once.
    ///
    /// # Errors
    /// If the recording could not be written.
    pub fn start_rally(&mut self, readiness: [RallyReadiness; 2]) -> Result<(), RecordError> {
        debug_assert!(self.rally.is_none() && self.end.is_none());
        let (number, game_step) = (self.rallies, self.game.steps());
        self.rallies += 1;
        self.rally = Some(CurrentRally { number, steps: 0 });
        for ((robot, side), side_readiness) in self.sides.iter_mut().enumerate().zip(&readiness) {
            side.start_rally(side_readiness, number, game_step);
            if let Some(interpolation) = side_readiness.interpolation() {
                self.game.set_interpolation(robot, interpolation);
            }
        }
        self.sink.begin_rally(&RallyStart {
            rally: number,
            game_step,
            serving_side: Side::BOTH[self.game.referee().serving_robot],
            readiness: &readiness,
            state: &self.game.state(),
        })?;
        self.end_if_over(None)
    }

    /// The next observation for a side; `None` if its arm holds after a fault.
    ///
    /// # Errors
    /// If the simulator failed, which is not an agent fault.
    pub fn action_request(
        &self,
        side: Side,
    ) -> Result<Option<ActionRequest<'_>>, NonFiniteObservation> {
        if self.fault(side).is_some() {
            return Ok(None);
        }
        let step = self.rally_steps();
        let observation = &self.game.observation(side.index())[..];
        // Later observations are finite, since a diverging world ends the rally.
        if step == 0 && observation.iter().any(|value| !value.is_finite()) {
            return Err(NonFiniteObservation {
                agent_task: AgentTask::Game { side },
                episode: self.rally(),
            });
        }
        Ok(Some(ActionRequest { step, observation }))
    }

    /// Simulates one control step.
    ///
    /// # Errors
    /// If the recording could not be written.
    pub fn answer(&mut self, responses: [Response<'_>; 2]) -> Result<(), RecordError> {
        let (number, step) = (self.rally(), self.rally_steps());
        let game_step = self.game.steps();
        debug_assert!(self.rally.is_some() && self.end.is_none());
        let effects =
            [0, 1].map(|side| self.apply_response(side, &responses[side], step, game_step));
        let commands = [0, 1].map(|side| match (&responses[side], effects[side]) {
            (Response::Answer { action, .. }, Effect::InTime) => Command::Act(action),
            // The arm holds its position, as after a late answer.
            _ => Command::Late,
        });
        let observations = [0, 1].map(|robot| &self.game.observation(robot)[..]);
        self.sink.observe(observations);
        let played = self.game.step(commands);
        for (side, constraints) in self.sides.iter_mut().zip(&played.constraints) {
            side.record_step(constraints);
        }
        if let Some(divergence) = played.divergence {
            self.record_divergence(divergence, number, step, game_step);
        }
        self.rally = Some(CurrentRally {
            number,
            steps: step + 1,
        });
        let sides = [0, 1].map(|side| SideStep {
            effect: effects[side],
            action: match &responses[side] {
                Response::Answer { action, .. } => Some(*action),
                Response::Fault { .. } | Response::Held => None,
            },
            timing: match &responses[side] {
                Response::Answer { timing, .. } | Response::Fault { timing, .. } => Some(*timing),
                Response::Held => None,
            },
            constraints: played.constraints[side],
        });
        self.sink.step(&GameStepRow {
            game_step,
            rally: number,
            step,
            sides,
            state: &played.state,
            puck_lost: played.puck_lost,
            impacts: &played.impacts,
        })?;
        if self.game.steps().is_multiple_of(WINDOW_STEPS) {
            self.sides.iter_mut().for_each(RunningSide::end_window);
        }
        self.end_if_over(played.rally_end.map(RallyEnding::Table))
    }

    /// Applies a side's response, and returns its effect.
    fn apply_response(
        &mut self,
        side: usize,
        response: &Response<'_>,
        step: u32,
        game_step: u32,
    ) -> Effect {
        let rally = self.rally();
        let side_state = &mut self.sides[side];
        match response {
            Response::Answer { timing, .. } => {
                let is_late = timing.computation_time_s > self.limits.max_answer_s;
                side_state.record_answer(timing, is_late);
                if is_late {
                    Effect::Late
                } else {
                    Effect::InTime
                }
            }
            Response::Fault { fault, timing } => {
                side_state.add_time(timing.computation_time_s);
                side_state.record_fault(fault.clone(), Phase::Step, rally, step, game_step);
                Effect::Fault
            }
            Response::Held => Effect::Held,
        }
    }

    /// Records a divergence as a fault of the sides whose robots caused it, unless they already had a fault in this rally.
    fn record_divergence(&mut self, divergence: Divergence, rally: u32, step: u32, game_step: u32) {
        for (side_state, _) in self
            .sides
            .iter_mut()
            .zip(divergence.robots_at_fault)
            .filter(|(side_state, is_cause)| *is_cause && side_state.fault().is_none())
        {
            let kind = AgentFaultKind::Diverged {
                detail: divergence.cause.to_string(),
            };
            let fault = SideFault { kind, line: None };
            side_state.record_fault(fault, Phase::Step, rally, step, game_step);
        }
    }

    /// Ends the game if a side has forfeited or all steps are played. Ends the rally if the game ends or if it has an `ending`.
    fn end_if_over(&mut self, ending: Option<RallyEnding>) -> Result<(), RecordError> {
        let [first, second] = &self.sides;
        let causes = [
            first.forfeit_cause(&self.limits),
            second.forfeit_cause(&self.limits),
        ];
        self.end = match causes {
            [Some(first), Some(second)] => Some(GameEnd::BothForfeit {
                causes: [first, second],
            }),
            [Some(cause), None] => Some(GameEnd::Forfeit {
                by: Side::First,
                cause,
            }),
            [None, Some(cause)] => Some(GameEnd::Forfeit {
                by: Side::Second,
                cause,
            }),
            [None, None] => (self.game.steps() >= self.planned_steps).then_some(GameEnd::Played),
        };
        let game_over = self.end.as_ref().map(|_| RallyEnding::GameOver);
        let (Some(ending), Some(rally)) = (ending.or(game_over), self.rally) else {
            return Ok(());
        };
        self.rally = None;
        self.sink.end_rally(&RallyRow {
            rally: rally.number,
            steps: rally.steps,
            ending,
            faults: [first.fault(), second.fault()],
            score: self.game.referee().score(),
        })
    }

    /// The outcome of the game.
    ///
    /// # Panics
    /// If the game has not ended.
    pub fn finish(self) -> FinishedGame<S> {
        let end = self.end.expect("a game is finished once it has ended");
        let referee = self.game.referee();
        let [first, second] = self.sides;
        let (first, first_times) = first.finish(referee.goals[0], referee.fouls[0]);
        let (second, second_times) = second.finish(referee.goals[1], referee.fouls[1]);
        FinishedGame {
            outcome: GameOutcome {
                steps: self.game.steps(),
                rallies: self.rallies,
                end,
                sides: [first, second],
            },
            answer_times_s: [first_times, second_times],
            sink: self.sink,
        }
    }
}
