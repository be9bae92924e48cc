//! What a viewer sees of stages: nobody but the organiser the scores of a blind one, and what was scored since boards
//! stand still only its team beside; without a token what is published. And of games: all results of rounds, its own of
//! what does not count, and of recordings its own side's until they are published.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
};
use faceoff_store::{
    Evaluation, EvaluationState, Game, GamePurpose, Ruling, Stage, StagePhase, StoreError,
    Tournament, TournamentRound,
};
use faceoff_types::{Publishes, Side, StageId};
use jiff::Timestamp;
use std::collections::BTreeMap;

/// The stages as they are now, seen by somebody.
#[derive(Debug)]
pub struct Sight {
    viewer: Viewer,
    stages: BTreeMap<StageId, Told>,
}

/// What a stage tells, whoever asks.
#[derive(Debug)]
struct Told {
    name: String,
    is_blind: bool,
    publishes: Publishes,
    has_closed: bool,
    /// Its boards stand still, if they do.
    frozen: Option<Ruling>,
}

impl Told {
    /// What its boards leave out of what was scored at this time.
    fn leaves_out(&self, scored_at: Timestamp) -> Option<&Ruling> {
        self.frozen.as_ref().filter(|frozen| scored_at > frozen.at)
    }
}

/// When an evaluation got its score, if it has one.
const fn scored_at(state: &EvaluationState) -> Option<Timestamp> {
    match state {
        EvaluationState::Finished { finished_at, .. } => Some(*finished_at),
        _ => None,
    }
}

impl Sight {
    /// What a viewer sees now.
    #[boxed]
    pub async fn of(app: &AppState, viewer: Viewer) -> Result<Self, Problem> {
        let now = app.config.clock.now();
        let season_has_closed = app.store.season().await?.closed_at.is_some();
        let mut frozen: BTreeMap<StageId, Ruling> =
            app.store.frozen_boards().await?.into_iter().collect();
        let told = |stage: Stage| {
            let told = Told {
                frozen: frozen.remove(&stage.id),
                is_blind: stage.settings.blind,
                publishes: stage.settings.publishes,
                has_closed: season_has_closed || stage.phase(now) == StagePhase::Closed,
                name: stage.name.to_string(),
            };
            (stage.id, told)
        };
        let stages = app.store.stages().await?;
        Ok(Self {
            viewer,
            stages: stages.into_iter().map(told).collect(),
        })
    }

    #[boxed]
    pub async fn of_organiser(app: &AppState) -> Result<Self, Problem> {
        Self::of(app, Viewer::Organiser).await
    }

    /// Refuses everybody but organisers, of whom `what` is.
    ///
    /// # Errors
    /// `Unauthenticated` or `Forbidden`.
    pub(crate) fn check_organiser(&self, what: &str) -> Result<(), Problem> {
        self.viewer.check_organiser(what)
    }

    /// Are a stage's scores hidden from the viewer?
    pub fn is_hidden(&self, stage: StageId) -> bool {
        let is_blind = self.stages.get(&stage).is_none_or(|told| told.is_blind);
        is_blind && self.viewer != Viewer::Organiser
    }

    /// Refuses what tells of a stage's scores, if they are hidden from the viewer.
    ///
    /// # Errors
    /// `Blind`.
    pub fn check_shown(&self, stage: StageId) -> Result<(), Problem> {
        if !self.is_hidden(stage) {
            return Ok(());
        }
        let name = self
            .stages
            .get(&stage)
            .map_or("", |told| told.name.as_str());
        Err(Problem::new(
            ProblemKind::Blind,
            format!(
                "the stage {name:?} is blind: its scores, datasets and comparisons are hidden from everybody until the \
                 organiser opens it, and nobody knows when that is"
            ),
        ))
    }

    /// Since when a stage's boards stand still, and why; `None` if they do not.
    pub fn frozen(&self, stage: StageId) -> Option<&Ruling> {
        self.stages.get(&stage)?.frozen.as_ref()
    }

    /// The freeze of a stage's boards that keeps what was scored at this time from the viewer, on boards, pages and in
    /// comparisons; `None` if none does, and for organisers.
    pub fn freeze_hiding(&self, stage: StageId, scored_at: Timestamp) -> Option<&Ruling> {
        if self.viewer == Viewer::Organiser {
            return None;
        }
        self.stages.get(&stage)?.leaves_out(scored_at)
    }

    /// Refuses an evaluation with a score that frozen boards leave out, unless the viewer is an organiser; `then` says
    /// what is done with it once they are unfrozen.
    ///
    /// # Errors
    /// `NotYet`.
    pub fn check_not_frozen(&self, evaluation: &Evaluation, then: &str) -> Result<(), Problem> {
        let at = scored_at(&evaluation.state);
        let Some(frozen) = at.and_then(|at| self.freeze_hiding(evaluation.of.stage, at)) else {
            return Ok(());
        };
        Err(Problem::new(
            ProblemKind::NotYet,
            format!(
                "the boards of the stage are frozen since {} ({}), and this result came later; it is {then} once they \
                 are unfrozen",
                frozen.at.strftime("%Y-%m-%d %H:%M UTC"),
                frozen.reason
            ),
        ))
    }

    /// Does anybody see an evaluation, and its dataset if it has one, without a token? Not what frozen boards leave out.
    pub fn is_public(&self, evaluation: &Evaluation) -> bool {
        let Some(told) = self.stages.get(&evaluation.of.stage) else {
            return false;
        };
        let by_stage = match told.publishes {
            Publishes::Never => false,
            Publishes::AtClose => told.has_closed,
            Publishes::AtRelease => true,
        };
        let is_left_out =
            scored_at(&evaluation.state).is_some_and(|at| told.leaves_out(at).is_some());
        !told.is_blind
            && !is_left_out
            && evaluation.released_at.is_some()
            && (by_stage || evaluation.published_at.is_some())
    }

    /// Does the viewer see what is an evaluation's team's alone: faults and logs?
    pub fn is_own(&self, evaluation: &Evaluation) -> bool {
        match self.viewer {
            Viewer::Organiser => true,
            Viewer::Team(team) => team == evaluation.team,
            Viewer::Anybody => false,
        }
    }

    /// What was found, if the viewer may read it: another team's looks like none at all unless it is public.
    ///
    /// # Errors
    /// `NotFound`; without a token `Unauthenticated`, whether there is one or not.
    pub fn readable(&self, found: Result<Evaluation, StoreError>) -> Result<Evaluation, Problem> {
        match found {
            Ok(found) if self.is_own(&found) || self.is_public(&found) => Ok(found),
            Ok(_) | Err(StoreError::NotFound(_)) if self.viewer == Viewer::Anybody => {
                Err(Problem::new(
                    ProblemKind::Unauthenticated,
                    "no token came, and there is no such evaluation that is public; send the header “Authorization: \
                     Bearer TOKEN” with its team's token, or the organiser's",
                ))
            }
            Ok(_) | Err(StoreError::NotFound(_)) => Err(Problem::not_found("evaluation")),
            Err(error) => Err(error.into()),
        }
    }
}

/// What a viewer sees of a tournament's games.
#[derive(Debug, Clone, Copy)]
pub struct GameSight<'a> {
    viewer: Viewer,
    tournament: &'a Tournament,
    rounds: &'a [TournamentRound],
}

impl<'a> GameSight<'a> {
    /// Of a tournament with these rounds.
    pub const fn new(
        viewer: Viewer,
        tournament: &'a Tournament,
        rounds: &'a [TournamentRound],
    ) -> Self {
        Self {
            viewer,
            tournament,
            rounds,
        }
    }

    /// Does the viewer know of a game, and what it came to? What does not count is its two teams'.
    pub fn shows(self, game: &Game) -> bool {
        match game.purpose {
            GamePurpose::Round(_) | GamePurpose::Replay { .. } => true,
            GamePurpose::Test { .. } | GamePurpose::Friendly { .. } => {
                Side::BOTH.iter().any(|side| self.is_own(game, *side))
            }
        }
    }

    /// Is it the viewer's side, of which they see file and log at once?
    pub fn is_own(self, game: &Game, side: Side) -> bool {
        match self.viewer {
            Viewer::Organiser => true,
            Viewer::Team(team) => team == game.teams[side.index()],
            Viewer::Anybody => false,
        }
    }

    /// Is the recording of both sides, with the game's seed, there for everybody?
    pub fn is_public(self, game: &Game) -> bool {
        let GamePurpose::Round(meeting) = game.purpose else {
            return false;
        };
        let has_closed = self.tournament.closed_at.is_some();
        match self.tournament.settings.publishes {
            Publishes::Never => false,
            Publishes::AtClose => has_closed,
            Publishes::AtRelease => {
                let round = self.rounds.iter().find(|one| one.number == meeting.round);
                has_closed || round.is_some_and(|round| round.over_at.is_some())
            }
        }
    }

    /// Does the viewer see both sides' recording, and the game's seed?
    pub fn sees_both_sides(self, game: &Game) -> bool {
        self.viewer == Viewer::Organiser || self.is_public(game)
    }

    /// Refuses what the viewer does not see of a game that they know of; `what` it is, in words.
    ///
    /// # Errors
    /// `Unauthenticated` or `Forbidden`, with when it comes out.
    pub fn refused(self, game: &Game, what: &str) -> Problem {
        let when = match (&game.purpose, self.tournament.settings.publishes) {
            (GamePurpose::Round(_), Publishes::AtRelease) => {
                "it is there for everybody when its round is over"
            }
            (GamePurpose::Round(_), Publishes::AtClose) => {
                "it is there for everybody when the tournament is closed"
            }
            _ => "it is never there for everybody",
        };
        Problem::new(
            self.viewer.refusal(),
            format!("{what} is not yours to see: {when}; a team gets its own side's at once"),
        )
    }
}
