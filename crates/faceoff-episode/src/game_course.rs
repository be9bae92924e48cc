use crate::{
    arena::Arena,
    course::{NotFinite, Question, are_finite},
    game_record::{
        Effect, Entry, GameSink, GameStepRow, RallyEnding, RallyRow, RallyStart, Response,
        SideFault, SideStep,
    },
    game_side::SideCourse,
    record::RecordError,
};
use faceoff_sim::{Command, Divergence, Game};
use faceoff_types::{
    AgentFault, AgentFaultKind, Contest, GameEnd, GameLimits, GameOutcome, Interpolation, Phase,
    Side, WINDOW_STEPS,
};

/// A game under way: tells what each side is to be asked, takes what comes of it, and decides what it leads
/// to. Whoever drives it brings the answers, from two processes or from a recording:
///
/// ```
/// # use faceoff_episode::{Answered, Arena, Entry, GameCourse, Nowhere, Response};
/// # use faceoff_types::{GameEnd, GameLimits, Interpolation, Profile, Seed, Side};
/// # let seed = Seed::from_number(1);
/// # let answered = Answered { computation_time_s: 0.001, host_time_s: 0.0, cpu_time_s: None };
/// let arena = Arena::new(Profile::Ideal, seed, seed.model_mismatch());
/// let mut course = GameCourse::begin(&arena, 900, GameLimits::default(), Nowhere);
/// while course.end().is_none() {
///     course.start_rally(Side::BOTH.map(|side| Entry::Plays {
///         startup_s: course.needs_start(side).then_some(0.1),
///         interpolation: Interpolation::Linear,
///         reset_s: 0.001,
///     }))?;
///     while course.is_in_rally() {
///         let actions = Side::BOTH.map(|side| match course.question(side) {
///             Ok(Some(question)) => question.observation[6..13].to_vec(),
///             other => panic!("{other:?}"),
///         });
///         let [a, b] = &actions;
///         course.answer([a, b].map(|action| Response::Answer { action, answered }))?;
///     }
/// }
/// let played = course.finish();
/// assert_eq!((played.outcome.steps, played.outcome.end), (900, GameEnd::Played));
/// # Ok::<(), faceoff_episode::RecordError>(())
/// ```
///
/// A control step takes both sides' responses at once, so that whose came first decides nothing.
#[derive(Debug)]
pub struct GameCourse<S> {
    game: Game,
    /// Control steps of the whole game.
    planned_steps: u32,
    limits: GameLimits,
    sides: [SideCourse; 2],
    /// The rally under way; `None` before it begins.
    rally: Option<RallyUnderWay>,
    rallies: u32,
    end: Option<GameEnd>,
    sink: S,
}

#[derive(Debug, Clone, Copy)]
struct RallyUnderWay {
    number: u32,
    steps: u32,
}

/// What a game has come to.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishedGame<S> {
    /// All that scoring needs but the times.
    pub outcome: GameOutcome,
    /// Computation times of each side's answers, in order of play, in seconds.
    pub answer_times_s: [Vec<f64>; 2],
    /// Where its course went.
    pub sink: S,
}

impl<S: GameSink> GameCourse<S> {
    /// A game of `steps` control steps before its first rally; the arena's seed is the game's.
    pub fn begin(arena: &Arena, steps: u32, limits: GameLimits, sink: S) -> Self {
        Self {
            // What actions mean is told before each rally.
            game: arena.game([Interpolation::Cubic; 2]),
            planned_steps: steps,
            limits,
            sides: Side::BOTH.map(SideCourse::new),
            rally: None,
            rallies: 0,
            end: None,
            sink,
        }
    }

    /// Must this side be started before the coming rally? So at the beginning, and after each fault.
    pub fn needs_start(&self, side: Side) -> bool {
        self.sides[side.index()].needs_start()
    }

    /// Number of the rally under way, or of the coming one, from 0.
    pub fn rally(&self) -> u32 {
        self.rally.map_or(self.rallies, |rally| rally.number)
    }

    /// Control steps of the rally under way; 0 between rallies.
    pub fn rally_steps(&self) -> u32 {
        self.rally.map_or(0, |rally| rally.steps)
    }

    /// Is a rally under way?
    pub const fn is_in_rally(&self) -> bool {
        self.rally.is_some()
    }

    /// How the game ended; `None` while it is under way.
    pub const fn end(&self) -> Option<&GameEnd> {
        self.end.as_ref()
    }

    /// The side's fault in the rally under way, or in the last one.
    pub const fn fault(&self, side: Side) -> Option<&AgentFault> {
        self.sides[side.index()].fault()
    }

    /// Where the game's course goes.
    pub const fn sink(&mut self) -> &mut S {
        &mut self.sink
    }

    /// Begins the next rally with what came of both sides' getting ready. If a side has used up its faults
    /// or its time by that, the rally, and the game, is over at once.
    ///
    /// # Errors
    /// The recording could not be written.
    pub fn start_rally(&mut self, entries: [Entry; 2]) -> Result<(), RecordError> {
        debug_assert!(self.rally.is_none() && self.end.is_none());
        let (number, game_step) = (self.rallies, self.game.steps());
        self.rallies += 1;
        self.rally = Some(RallyUnderWay { number, steps: 0 });
        for ((robot, side), entry) in self.sides.iter_mut().enumerate().zip(&entries) {
            side.enter(entry, number, game_step);
            if let Some(interpolation) = entry.interpolation() {
                self.game.interpolate(robot, interpolation);
            }
        }
        self.sink.begin_rally(&RallyStart {
            rally: number,
            game_step,
            serves: Side::BOTH[self.game.referee().serves],
            entries: &entries,
            state: &self.game.state(),
        })?;
        self.end_if_over(None)
    }

    /// What a side is to be asked next; `None` if it is not: its arm holds.
    ///
    /// # Errors
    /// The simulator failed: this is nobody's fault.
    pub fn question(&self, side: Side) -> Result<Option<Question<'_>>, NotFinite> {
        if self.fault(side).is_some() {
            return Ok(None);
        }
        let step = self.rally_steps();
        let observation = &self.game.observation(side.index())[..];
        // Later ones are finite: a world that diverges begins another rally.
        if step == 0 && !are_finite(observation) {
            return Err(NotFinite {
                contest: Contest::Game { side },
                episode: self.rally(),
            });
        }
        Ok(Some(Question { step, observation }))
    }

    /// Plays one control step.
    ///
    /// # Errors
    /// The recording could not be written.
    pub fn answer(&mut self, responses: [Response<'_>; 2]) -> Result<(), RecordError> {
        let (number, step) = (self.rally(), self.rally_steps());
        let game_step = self.game.steps();
        debug_assert!(self.rally.is_some() && self.end.is_none());
        let effects = [0, 1].map(|side| self.take(side, &responses[side], step, game_step));
        let commands = [0, 1].map(|side| match (&responses[side], effects[side]) {
            (Response::Answer { action, .. }, Effect::InTime) => Command::Act(action),
            _ => Command::Late,
        });
        let observations = [0, 1].map(|robot| &self.game.observation(robot)[..]);
        self.sink.observe(observations);
        let played = self.game.step(commands);
        for (side, constraints) in self.sides.iter_mut().zip(&played.constraints) {
            side.step(constraints);
        }
        if let Some(divergence) = played.divergence {
            self.blame(divergence, number, step, game_step);
        }
        self.rally = Some(RallyUnderWay {
            number,
            steps: step + 1,
        });
        let sides = [0, 1].map(|side| SideStep {
            effect: effects[side],
            action: match &responses[side] {
                Response::Answer { action, .. } => Some(*action),
                Response::Fault { .. } | Response::Held => None,
            },
            answered: match &responses[side] {
                Response::Answer { answered, .. } | Response::Fault { answered, .. } => {
                    Some(*answered)
                }
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
            self.sides.iter_mut().for_each(SideCourse::end_window);
        }
        self.end_if_over(played.rally_end.map(RallyEnding::Table))
    }

    /// What a side's response leads to.
    fn take(&mut self, side: usize, response: &Response<'_>, step: u32, game_step: u32) -> Effect {
        let rally = self.rally();
        let course = &mut self.sides[side];
        match response {
            Response::Answer { answered, .. } => {
                let is_late = answered.computation_time_s > self.limits.in_time_s;
                course.answer(answered, is_late);
                if is_late {
                    Effect::Late
                } else {
                    Effect::InTime
                }
            }
            Response::Fault { fault, answered } => {
                course.spend(answered.computation_time_s);
                course.fail(fault.clone(), Phase::Step, rally, step, game_step);
                Effect::Fault
            }
            Response::Held => Effect::Held,
        }
    }

    /// A world that diverged is the fault of the robots that it names; one that had a fault in this rally
    /// has it already.
    fn blame(&mut self, divergence: Divergence, rally: u32, step: u32, game_step: u32) {
        for (course, _) in self
            .sides
            .iter_mut()
            .zip(divergence.by)
            .filter(|(course, named)| *named && course.fault().is_none())
        {
            let kind = AgentFaultKind::Diverged {
                detail: divergence.what.to_string(),
            };
            let fault = SideFault { kind, line: None };
            course.fail(fault, Phase::Step, rally, step, game_step);
        }
    }

    /// Ends the rally, if it is over, and the game.
    fn end_if_over(&mut self, ending: Option<RallyEnding>) -> Result<(), RecordError> {
        let [first, second] = &self.sides;
        let causes = [first.forfeits(&self.limits), second.forfeits(&self.limits)];
        self.end = match causes {
            [Some(a), Some(b)] => Some(GameEnd::BothForfeit { causes: [a, b] }),
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
        let over = self.end.as_ref().map(|_| RallyEnding::GameOver);
        let (Some(ending), Some(rally)) = (ending.or(over), self.rally) else {
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

    /// What the game has come to, which must have ended.
    ///
    /// # Panics
    /// If it has not.
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
