//! What a viewer may see.
//!
//! Evaluations: only organisers see the scores of *blind* stages. After a *freeze* of a stage's boards, later scores are visible to
//! organisers and the team only. Without a token only published evaluations are visible.
//!
//! Games: results of tournament rounds are public. Test and friendly games are visible to their two teams. Until the recording of a
//! game is published, each team sees only its own side of it.

use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
};
use faceoff_store::{
    DecisionRecord, Evaluation, EvaluationState, Game, GamePurpose, RunProgress, Stage, StagePhase,
    StoreError, Tournament, TournamentRound,
};
use faceoff_types::{Publication, Side, StageId};
use jiff::Timestamp;
use std::collections::BTreeMap;

/// What a viewer may see of all stages now.
#[derive(Debug)]
pub struct Visibility {
    viewer: Viewer,
    /// When this was determined.
    now: Timestamp,
    stages: BTreeMap<StageId, StageRestrictions>,
}

/// Settings of a stage that restrict visibility.
#[derive(Debug)]
struct StageRestrictions {
    name: String,
    is_blind: bool,
    /// When evaluations become public automatically.
    publication: Publication,
    /// Whether the stage or the whole season has closed.
    has_closed: bool,
    /// The freeze of the boards, if they are frozen.
    frozen: Option<DecisionRecord>,
}

impl StageRestrictions {
    /// The freeze that hides a score which was computed at this time, if there is one.
    fn hiding_freeze(&self, scored_at: Timestamp) -> Option<&DecisionRecord> {
        self.frozen.as_ref().filter(|frozen| scored_at > frozen.at)
    }
}

/// When an evaluation was scored; `None` without a score.
const fn scored_at(state: &EvaluationState) -> Option<Timestamp> {
    match state {
        EvaluationState::Finished { finished_at, .. } => Some(*finished_at),
        _ => None,
    }
}

impl Visibility {
    /// What the viewer may see now.
    #[boxed_future]
    pub async fn load(app: &AppState, viewer: Viewer) -> Result<Self, Problem> {
        let now = app.config.clock.now();
        let season_has_closed = app.store.season().await?.closed_at.is_some();
        let mut frozen: BTreeMap<StageId, DecisionRecord> =
            app.store.frozen_boards().await?.into_iter().collect();
        let restrictions = |stage: Stage| {
            let restrictions = StageRestrictions {
                frozen: frozen.remove(&stage.id),
                is_blind: stage.settings.blind,
                publication: stage.settings.publishes,
                has_closed: season_has_closed || stage.phase(now) == StagePhase::Closed,
                name: stage.name.to_string(),
            };
            (stage.id, restrictions)
        };
        let stages = app.store.stages().await?;
        Ok(Self {
            viewer,
            now,
            stages: stages.into_iter().map(restrictions).collect(),
        })
    }

    #[boxed_future]
    pub async fn for_organiser(app: &AppState) -> Result<Self, Problem> {
        Self::load(app, Viewer::Organiser).await
    }

    /// The number of finished episodes of a run, as the viewer may see it. Teams and visitors see only whole shards (parts of a run), once
    /// a minute.
    pub(crate) fn episodes_done(&self, progress: &RunProgress) -> u32 {
        match self.viewer {
            Viewer::Organiser => progress.episodes_done,
            Viewer::Team(_) | Viewer::Visitor => progress.episodes_visible_to_team(self.now),
        }
    }

    /// Refuses all viewers but organisers; `resource` is its name in the message.
    ///
    /// # Errors
    /// `Unauthenticated` or `Forbidden`.
    pub(crate) fn check_organiser(&self, resource: &str) -> Result<(), Problem> {
        self.viewer.check_organiser(resource)
    }

    /// Whether a stage's scores are hidden from the viewer: the stage is blind, and the viewer is no organiser.
    pub fn hides_scores(&self, stage: StageId) -> bool {
        let is_blind = self.stages.get(&stage).is_none_or(|stage| stage.is_blind);
        is_blind && self.viewer != Viewer::Organiser
    }

    /// Refuses data that reveals a stage's scores, if they are hidden from the viewer.
    ///
    /// # Errors
    /// `Blind`.
    pub fn check_not_blind(&self, stage: StageId) -> Result<(), Problem> {
        if !self.hides_scores(stage) {
            return Ok(());
        }
        let name = self
            .stages
            .get(&stage)
            .map_or("", |stage| stage.name.as_str());
        Err(Problem::new(
            ProblemKind::Blind,
            format!(
                "the stage {name:?} is blind: its scores, datasets and comparisons are hidden until the organisers reveal \
                 them; no date is set"
            ),
        ))
    }

    /// Since when a stage's boards are frozen, and why; `None` if they are not.
    pub fn frozen(&self, stage: StageId) -> Option<&DecisionRecord> {
        self.stages.get(&stage)?.frozen.as_ref()
    }

    /// The freeze that hides a score which was computed at this time from the viewer, on boards, pages and in comparisons. `None` if
    /// the score is visible; it always is for organisers.
    pub fn hiding_freeze(&self, stage: StageId, scored_at: Timestamp) -> Option<&DecisionRecord> {
        if self.viewer == Viewer::Organiser {
            return None;
        }
        self.stages.get(&stage)?.hiding_freeze(scored_at)
    }

    /// Refuses an evaluation whose score a freeze hides from the viewer. `action` completes the
    /// message “it can be … once they are unfrozen”, for example “compared”.
    ///
    /// # Errors
    /// `NotYet`.
    pub fn check_not_frozen(&self, evaluation: &Evaluation, action: &str) -> Result<(), Problem> {
        let at = scored_at(&evaluation.state);
        let Some(frozen) = at.and_then(|at| self.hiding_freeze(evaluation.stage_day.stage, at))
        else {
            return Ok(());
        };
        Err(Problem::new(
            ProblemKind::NotYet,
            format!(
                "the boards of the stage have been frozen since {} ({}), before this result; it can be {action} once they are \
                 unfrozen",
                frozen.at.strftime("%Y-%m-%d %H:%M UTC"),
                frozen.reason
            ),
        ))
    }

    /// Whether an evaluation and its dataset are public. A freeze of the boards hides later results.
    pub fn is_public(&self, evaluation: &Evaluation) -> bool {
        let Some(stage) = self.stages.get(&evaluation.stage_day.stage) else {
            return false;
        };
        let is_published_by_stage = match stage.publication {
            Publication::Never => false,
            Publication::AtClose => stage.has_closed,
            Publication::AtRelease => true,
        };
        let is_hidden_by_freeze =
            scored_at(&evaluation.state).is_some_and(|at| stage.hiding_freeze(at).is_some());
        !stage.is_blind
            && !is_hidden_by_freeze
            && evaluation.released_at.is_some()
            && (is_published_by_stage || evaluation.published_at.is_some())
    }

    /// Whether the viewer may see data that only the evaluation's team and organisers see: faults and logs.
    pub fn has_team_access(&self, evaluation: &Evaluation) -> bool {
        match self.viewer {
            Viewer::Organiser => true,
            Viewer::Team(team) => team == evaluation.team,
            Viewer::Visitor => false,
        }
    }

    /// The evaluation, if the viewer may read it; otherwise the same error as if it did not exist.
    ///
    /// # Errors
    /// `NotFound`; without a token `Unauthenticated`, whether it exists or not.
    pub fn readable(
        &self,
        evaluation: Result<Evaluation, StoreError>,
    ) -> Result<Evaluation, Problem> {
        match evaluation {
            Ok(evaluation) if self.has_team_access(&evaluation) || self.is_public(&evaluation) => {
                Ok(evaluation)
            }
            Ok(_) | Err(StoreError::NotFound(_)) if self.viewer == Viewer::Visitor => {
                Err(Problem::new(
                    ProblemKind::Unauthenticated,
                    "there is no such public evaluation, and the request has no token; send the header “Authorization: \
                     Bearer TOKEN” with its team's token, or an organiser's",
                ))
            }
            Ok(_) | Err(StoreError::NotFound(_)) => Err(Problem::not_found("evaluation")),
            Err(error) => Err(error.into()),
        }
    }
}

/// What a viewer may see of a tournament's games.
#[derive(Debug, Clone, Copy)]
pub struct GameVisibility<'a> {
    viewer: Viewer,
    tournament: &'a Tournament,
    rounds: &'a [TournamentRound],
}

impl<'a> GameVisibility<'a> {
    /// For a tournament with these rounds.
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

    /// Whether the viewer may see a game and its result. Test and friendly games are visible only to their two teams.
    pub fn is_visible(self, game: &Game) -> bool {
        match game.purpose {
            GamePurpose::Round(_) | GamePurpose::ScheduleReplay { .. } => true,
            GamePurpose::Test { .. } | GamePurpose::Friendly { .. } => Side::BOTH
                .iter()
                .any(|side| self.has_team_access(game, *side)),
        }
    }

    /// Whether the viewer may see this side's recording and log at once: the side's team, and organisers.
    pub fn has_team_access(self, game: &Game, side: Side) -> bool {
        match self.viewer {
            Viewer::Organiser => true,
            Viewer::Team(team) => team == game.teams[side.index()],
            Viewer::Visitor => false,
        }
    }

    /// Whether the recording of both sides, with the game's seed, is public.
    pub fn is_public(self, game: &Game) -> bool {
        let GamePurpose::Round(schedule_entry) = game.purpose else {
            return false;
        };
        let has_closed = self.tournament.closed_at.is_some();
        match self.tournament.settings.publishes {
            Publication::Never => false,
            Publication::AtClose => has_closed,
            Publication::AtRelease => {
                let round = self
                    .rounds
                    .iter()
                    .find(|round| round.number == schedule_entry.round);
                has_closed || round.is_some_and(|round| round.over_at.is_some())
            }
        }
    }

    /// Whether the viewer may see both sides' recording, and the game's seed.
    pub fn can_see_both_sides(self, game: &Game) -> bool {
        self.viewer == Viewer::Organiser || self.is_public(game)
    }

    /// The problem for data of a visible game that the viewer may not see; `data` is its name in the message.
    ///
    /// # Errors
    /// `Unauthenticated` or `Forbidden`, with the time of its publication.
    pub fn denial(self, game: &Game, data: &str) -> Problem {
        let publication = match (&game.purpose, self.tournament.settings.publishes) {
            (GamePurpose::Round(_), Publication::AtRelease) => {
                "it becomes public when its round is over"
            }
            (GamePurpose::Round(_), Publication::AtClose) => {
                "it becomes public when the tournament is closed"
            }
            _ => "it never becomes public",
        };
        Problem::new(
            self.viewer.denial_kind(),
            format!("you may not see {data}: {publication}; a team can see its own side's at once"),
        )
    }
}
