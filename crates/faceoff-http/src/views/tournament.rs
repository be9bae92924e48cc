//! A tournament: its rules, who is in it, its rounds, its tables, and what comes next.

use super::{ruling::RulingView, tournament_sheet::TournamentSheet};
use crate::{app::AppState, problem::Problem, views::shown};
use faceoff_scoring::tournament::schedule::Table;
use faceoff_store::{Entrant, Game, GamePurpose, GameState, Leave, TournamentRound};
use faceoff_types::{
    LeftAs, RoundNumber, StageId, StageName, SubmissionId, TeamId, TeamName, TournamentId,
    TournamentRules, TournamentSettings,
};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A tournament, as lists have it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TournamentHead {
    /// Names the tournament in paths.
    pub id: TournamentId,
    /// In its season, from 1; its seeds follow from it.
    pub number: u32,
    /// As the organiser named it.
    pub name: StageName,
    /// Where it is now.
    pub phase: TournamentPhase,
    /// When the organiser opened it.
    pub created_at: Timestamp,
    /// The stage whose tiers its first entrants come from; null: the organiser named them.
    pub stage: Option<StageId>,
    /// No game of it begins: since when, and why; null otherwise.
    pub paused: Option<RulingView>,
    /// From then on nothing of it changes; null: it is not closed.
    pub closed_at: Option<Timestamp>,
    /// First of the deciding table, once all rounds are over; null before.
    pub champion: Option<TeamName>,
    /// What comes next.
    pub next: String,
}

/// Where a tournament is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TournamentPhase {
    /// No round was started: entrants and rules may change.
    Open,
    /// A game of a round has no result and can still get one.
    Round,
    /// All games of the rounds that were started have results, and there is another round.
    Between,
    /// All rounds are over.
    Played,
    /// The organiser has closed it.
    Closed,
}

/// A tournament with all that everybody may know of it but its games.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TournamentView {
    /// As lists have it.
    #[serde(flatten)]
    pub head: TournamentHead,
    /// What results depend on; fixed from the first round on.
    pub rules: TournamentRules,
    /// What they do not depend on.
    pub settings: TournamentSettings,
    /// The organisers' agent, against which teams may test theirs; null: none.
    pub baseline: Option<SubmissionId>,
    /// Its teams, by name, those that left included.
    pub entrants: Vec<EntrantView>,
    /// Those that were started, in order.
    pub rounds: Vec<RoundView>,
    /// The standings, the deciding ones first: one table, or the final's and each group's.
    pub tables: Vec<Table>,
}

/// A team of a tournament.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct EntrantView {
    /// Which.
    pub team: TeamId,
    /// As it is called now.
    pub team_name: TeamName,
    /// Since when it is in it.
    pub entered_at: Timestamp,
    /// It plays no more in it; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left: Option<LeaveView>,
}

/// A team left.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct LeaveView {
    /// How.
    pub r#as: LeftAs,
    /// The first round whose games with it do not count.
    #[schema(value_type = u32, minimum = 1, maximum = 100)]
    pub from_round: RoundNumber,
    /// When.
    pub at: Timestamp,
    /// As everybody may read it.
    pub reason: String,
}

/// A round, as it was drawn.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RoundView {
    /// From 1.
    #[schema(value_type = u32, minimum = 1, maximum = 100)]
    pub number: RoundNumber,
    /// From then on its submissions are fixed.
    pub started_at: Timestamp,
    /// When the last of its games had ended for the first time; null before.
    pub over_at: Option<Timestamp>,
    /// Games that can be played side by side, one after another.
    pub matchdays: u32,
    /// How far it is.
    pub progress: RoundProgress,
    /// Who plays in which group; empty without groups.
    pub groups: Vec<Vec<TeamName>>,
    /// Who has nobody to play, in the order of play.
    pub byes: Vec<ByeView>,
    /// What each team plays with.
    pub submissions: Vec<RoundSubmission>,
}

/// Of a round's games, how many stand how.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RoundProgress {
    /// All of them.
    pub games: u32,
    /// That have a result.
    pub played: u32,
    /// That a slot plays.
    pub running: u32,
    /// That wait for a slot.
    pub queued: u32,
    /// That wait for the organiser: void, or broken by us, to be played again.
    pub to_be_rerun: u32,
    /// That are not played, since a side left.
    pub cancelled: u32,
}

/// A team that has nobody to play on a matchday.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ByeView {
    /// From 1.
    pub matchday: u32,
    /// Which.
    pub team: TeamId,
    /// As it is called now.
    pub team_name: TeamName,
}

/// What a team plays a round with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RoundSubmission {
    /// Which team.
    pub team: TeamId,
    /// As it is called now.
    pub team_name: TeamName,
    /// What it had active when the round was started.
    pub submission: SubmissionId,
}

impl TournamentHead {
    /// All of the season, the first one first.
    pub(crate) async fn all(app: &AppState) -> Result<Vec<Self>, Problem> {
        let mut heads = Vec::new();
        for tournament in app.store.tournaments().await? {
            let sheet = TournamentSheet::find(app, tournament.id).await?;
            heads.push(Self::of(&sheet));
        }
        Ok(heads)
    }

    fn of(sheet: &TournamentSheet) -> Self {
        let tables = sheet.tables(sheet.played());
        Self::with(sheet, &tables)
    }

    fn with(sheet: &TournamentSheet, tables: &[Table]) -> Self {
        let tournament = &sheet.tournament;
        let phase = phase(sheet);
        Self {
            id: tournament.id,
            number: tournament.number,
            name: tournament.name.clone(),
            phase,
            created_at: tournament.created_at,
            stage: tournament.stage,
            paused: tournament.paused.clone().map(RulingView::from),
            closed_at: tournament.closed_at,
            champion: champion(sheet, tables),
            next: next(sheet, phase),
        }
    }
}

impl TournamentView {
    pub(crate) async fn find(app: &AppState, id: TournamentId) -> Result<Self, Problem> {
        Self::of(&TournamentSheet::find(app, id).await?)
    }

    pub(crate) fn of(sheet: &TournamentSheet) -> Result<Self, Problem> {
        let tables = sheet.tables(sheet.played());
        let tournament = &sheet.tournament;
        let rounds = sheet.rounds.iter();
        Ok(Self {
            head: TournamentHead::with(sheet, &tables),
            rules: tournament.rules.clone(),
            settings: tournament.settings.clone(),
            baseline: tournament.baseline,
            entrants: sheet
                .entrants
                .iter()
                .cloned()
                .map(EntrantView::from)
                .collect(),
            rounds: rounds
                .map(|round| RoundView::of(sheet, round))
                .collect::<Result<_, _>>()?,
            tables,
        })
    }
}

/// The tournaments that a team has entered, the first one first: ids and names.
pub(crate) async fn entered_by(
    app: &AppState,
    team: TeamId,
) -> Result<Vec<(TournamentId, StageName)>, Problem> {
    let mut entered = Vec::new();
    for tournament in app.store.tournaments().await? {
        let sheet = TournamentSheet::unscored(app, tournament.id).await?;
        if sheet.entrants.iter().any(|entrant| entrant.team == team) {
            entered.push((tournament.id, tournament.name));
        }
    }
    Ok(entered)
}

impl From<Entrant> for EntrantView {
    fn from(entrant: Entrant) -> Self {
        Self {
            team: entrant.team,
            team_name: entrant.name,
            entered_at: entrant.entered_at,
            left: entrant.left.map(LeaveView::from),
        }
    }
}

impl From<Leave> for LeaveView {
    fn from(leave: Leave) -> Self {
        Self {
            r#as: leave.left_as,
            from_round: leave.from_round,
            at: leave.at,
            reason: shown(leave.reason),
        }
    }
}

impl RoundView {
    pub(crate) fn of(sheet: &TournamentSheet, round: &TournamentRound) -> Result<Self, Problem> {
        let games = games_of(sheet, round.number);
        let names = |group: &Vec<TeamId>| -> Result<Vec<TeamName>, Problem> {
            group.iter().map(|team| sheet.name(*team)).collect()
        };
        let byes = round.byes.iter().map(|bye| {
            Ok(ByeView {
                matchday: bye.matchday,
                team: bye.team,
                team_name: sheet.name(bye.team)?,
            })
        });
        let submissions = round.submissions.iter().map(|(team, submission)| {
            Ok(RoundSubmission {
                team: *team,
                team_name: sheet.name(*team)?,
                submission: *submission,
            })
        });
        let mut progress = RoundProgress::default();
        let mut matchdays = 0;
        for (game, matchday) in games {
            matchdays = matchday.max(matchdays);
            progress.add(&game.state);
        }
        Ok(Self {
            number: round.number,
            started_at: round.started_at,
            over_at: round.over_at,
            matchdays,
            progress,
            groups: round.groups.iter().map(names).collect::<Result<_, _>>()?,
            byes: byes.collect::<Result<_, Problem>>()?,
            submissions: submissions.collect::<Result<_, Problem>>()?,
        })
    }
}

impl RoundProgress {
    const fn add(&mut self, state: &GameState) {
        self.games += 1;
        *match state {
            GameState::Queued => &mut self.queued,
            GameState::Running { .. } => &mut self.running,
            GameState::Played(_) => &mut self.played,
            GameState::Broken { .. } | GameState::Void { .. } => &mut self.to_be_rerun,
            GameState::Cancelled { .. } => &mut self.cancelled,
        } += 1;
    }
}

/// A round's games, with their matchdays.
fn games_of(sheet: &TournamentSheet, number: RoundNumber) -> impl Iterator<Item = (&Game, u32)> {
    sheet
        .games
        .iter()
        .filter_map(move |game| match game.purpose {
            GamePurpose::Round(meeting) if meeting.round == number => {
                Some((game, meeting.matchday))
            }
            _ => None,
        })
}

fn phase(sheet: &TournamentSheet) -> TournamentPhase {
    let last = sheet.tournament.rules.format.last_round();
    if sheet.tournament.closed_at.is_some() {
        TournamentPhase::Closed
    } else if sheet.rounds.is_empty() {
        TournamentPhase::Open
    } else if sheet.games.iter().any(|game| sheet.is_awaited(game))
        || sheet.rounds.iter().any(|round| round.over_at.is_none())
    {
        TournamentPhase::Round
    } else if sheet.rounds.len() < last.get() as usize {
        TournamentPhase::Between
    } else {
        TournamentPhase::Played
    }
}

/// Who is first of a table, and has not left.
pub(super) fn first_place(table: &Table) -> Option<TeamName> {
    let mut standings = table.standings.iter();
    let first = standings.find(|standing| standing.left.is_none())?;
    Some(first.team.clone())
}

fn champion(sheet: &TournamentSheet, tables: &[Table]) -> Option<TeamName> {
    let last = sheet.tournament.rules.format.last_round();
    // Of a round that was not over by then an archive has a part.
    let are_over = sheet.rounds.iter().all(|round| round.over_at.is_some());
    let is_over = sheet.rounds.len() >= last.get() as usize
        && are_over
        && !sheet.games.iter().any(|game| sheet.is_awaited(game));
    first_place(tables.first().filter(|_| is_over)?)
}

/// What comes next, in words for everybody.
fn next(sheet: &TournamentSheet, phase: TournamentPhase) -> String {
    let last = sheet.tournament.rules.format.last_round();
    let coming = sheet.rounds.len() + 1;
    match phase {
        TournamentPhase::Closed => "Nothing more: the tournament is closed.".to_owned(),
        TournamentPhase::Played => {
            "All rounds are over; the organiser closes the tournament.".to_owned()
        }
        TournamentPhase::Open | TournamentPhase::Between => format!(
            "The organiser starts round {coming} of {last}; what each team has active then plays all of it."
        ),
        TournamentPhase::Round => under_way(sheet),
    }
}

fn under_way(sheet: &TournamentSheet) -> String {
    let mut progress = RoundProgress::default();
    let awaited = sheet.games.iter().filter(|game| sheet.is_awaited(game));
    awaited.for_each(|game| progress.add(&game.state));
    let all = progress.games;
    let mut text = match &sheet.tournament.paused {
        Some(paused) => format!(
            "Paused ({}): no game begins. ",
            shown(paused.reason.clone())
        ),
        None => String::new(),
    };
    text += &format!(
        "Without a result: {all}; under way: {}, waiting for a slot: {}",
        progress.running, progress.queued
    );
    if progress.to_be_rerun > 0 {
        text += &format!(
            ", void or broken, which the organiser has played again: {}",
            progress.to_be_rerun
        );
    }
    let last = sheet.tournament.rules.format.last_round();
    if sheet.rounds.len() < last.get() as usize {
        text + ". The next round waits for them."
    } else {
        text + ". The tournament can be closed then."
    }
}
