//! Decisions of organisers: a preview of the effects, and the execution.

mod clock;
mod day;
mod evaluation;
mod game;
mod preview;
mod queue;
mod stage;
mod team;
mod tournament;
mod worker;

use clock::ClockDecision;
use day::DayDecision;
use evaluation::EvaluationDecision;
use faceoff_api::requests;
use faceoff_service::{app::AppState, auth::Organiser, problem::Problem};
use faceoff_types::{DepartureKind, RoundNumber};
use game::GameDecision;
use preview::DecisionOutcome;
pub(super) use preview::DecisionPreview;
use queue::QueueDecision;
use stage::StageDecision;
use std::{fmt, str::FromStr};
use team::TeamDecision;
use tournament::TournamentDecision;
use worker::WorkerDecision;

/// A decision, parsed from the path of its page.
#[derive(Debug, Clone)]
pub(super) enum Decision {
    Day(DayDecision),
    Queue(QueueDecision),
    Evaluation(EvaluationDecision),
    Team(TeamDecision),
    Stage(StageDecision),
    Tournament(TournamentDecision),
    Game(GameDecision),
    Worker(WorkerDecision),
    Clock(ClockDecision),
}

#[derive(Debug)]
pub(super) struct UnknownDecision;

impl fmt::Display for UnknownDecision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("unknown decision; go back to the dashboard and choose one there")
    }
}

impl FromStr for Decision {
    type Err = UnknownDecision;

    fn from_str(path: &str) -> Result<Self, UnknownDecision> {
        let (name, subject) = path.split_once('/').unwrap_or((path, ""));
        find(name, subject).ok_or(UnknownDecision)
    }
}

/// The decision with this name about this subject (the rest of the path).
fn find(name: &str, subject: &str) -> Option<Decision> {
    Some(match name {
        "start-day" => Decision::Day(DayDecision::Start(subject.parse().ok()?)),
        "missed-day" => Decision::Day(DayDecision::Missed(subject.parse().ok()?)),
        "void-day" => Decision::Day(DayDecision::Void(subject.parse().ok()?)),
        "pause" if subject.is_empty() => Decision::Queue(QueueDecision::Pause),
        "resume" if subject.is_empty() => Decision::Queue(QueueDecision::Resume),
        "accept-clock" if subject.is_empty() => Decision::Clock(ClockDecision),
        "void" => Decision::Evaluation(EvaluationDecision::Void(subject.parse().ok()?)),
        "cancel" => Decision::Evaluation(EvaluationDecision::Cancel(subject.parse().ok()?)),
        "rerun" => Decision::Evaluation(EvaluationDecision::Rerun(subject.parse().ok()?)),
        // `extra-turn` is the path in older versions.
        "extra-evaluation" | "extra-turn" => {
            let (day, team) = subject.rsplit_once('/')?;
            let (day, team) = (day.parse().ok()?, team.parse().ok()?);
            Decision::Evaluation(EvaluationDecision::Extra(day, team))
        }
        "disqualify" => Decision::Team(TeamDecision::Disqualify(subject.parse().ok()?)),
        "reinstate" => Decision::Team(TeamDecision::Reinstate(subject.parse().ok()?)),
        "approve" => Decision::Team(TeamDecision::Approve(subject.parse().ok()?)),
        "refuse" => Decision::Team(TeamDecision::Refuse(subject.parse().ok()?)),
        "freeze" => Decision::Stage(StageDecision::Freeze(subject.parse().ok()?)),
        "unfreeze" => Decision::Stage(StageDecision::Unfreeze(subject.parse().ok()?)),
        "final-day" => Decision::Stage(StageDecision::FinalDay(subject.parse().ok()?)),
        "sign-off" => Decision::Stage(StageDecision::SignOff(subject.parse().ok()?)),
        "start-round" => {
            let (tournament, number) = subject.split_once('/')?;
            let number = RoundNumber::try_from(number.parse::<u32>().ok()?).ok()?;
            Decision::Tournament(TournamentDecision::StartRound(
                tournament.parse().ok()?,
                number,
            ))
        }
        "pause-tournament" => {
            Decision::Tournament(TournamentDecision::Pause(subject.parse().ok()?))
        }
        "resume-tournament" => {
            Decision::Tournament(TournamentDecision::Resume(subject.parse().ok()?))
        }
        "close-tournament" => {
            Decision::Tournament(TournamentDecision::Close(subject.parse().ok()?))
        }
        "withdraw-team" | "disqualify-team" => {
            let (tournament, team) = subject.split_once('/')?;
            let (tournament, team) = (tournament.parse().ok()?, team.parse().ok()?);
            let kind = match name {
                "withdraw-team" => DepartureKind::Withdrawn,
                _ => DepartureKind::Disqualified,
            };
            Decision::Tournament(TournamentDecision::Leave(tournament, team, kind))
        }
        "void-game" => Decision::Game(GameDecision::Void(subject.parse().ok()?)),
        "rerun-game" => Decision::Game(GameDecision::Rerun(subject.parse().ok()?)),
        "ban" => Decision::Worker(WorkerDecision::Ban(subject.parse().ok()?)),
        "readmit" => Decision::Worker(WorkerDecision::Readmit(subject.parse().ok()?)),
        _ => return None,
    })
}

impl Decision {
    pub(super) async fn preview(&self, app: &AppState) -> Result<DecisionPreview, Problem> {
        match self {
            Self::Day(decision) => decision.preview(app).await,
            Self::Queue(decision) => decision.preview(app).await,
            Self::Evaluation(decision) => decision.preview(app).await,
            Self::Team(decision) => decision.preview(app).await,
            Self::Stage(decision) => decision.preview(app).await,
            Self::Tournament(decision) => decision.preview(app).await,
            Self::Game(decision) => decision.preview(app).await,
            Self::Worker(decision) => Ok(decision.preview()),
            Self::Clock(decision) => decision.preview(app),
        }
    }

    /// Executes the decision like the API.
    pub(super) async fn carry_out(
        &self,
        app: &AppState,
        organiser: &Organiser,
        request: requests::Decision,
    ) -> Result<DecisionOutcome, Problem> {
        let actor = organiser.actor();
        match self {
            Self::Day(decision) => decision.carry_out(app, actor, request).await,
            Self::Queue(decision) => decision.carry_out(app, actor, request).await,
            Self::Evaluation(decision) => decision.carry_out(app, actor, request).await,
            Self::Team(decision) => decision.carry_out(app, organiser, request).await,
            Self::Stage(decision) => decision.carry_out(app, actor, request).await,
            Self::Tournament(decision) => decision.carry_out(app, actor, request).await,
            Self::Game(decision) => decision.carry_out(app, actor, request).await,
            Self::Worker(decision) => decision.carry_out(app, actor, request).await,
            Self::Clock(decision) => decision.carry_out(app, actor, request).await,
        }
    }
}
