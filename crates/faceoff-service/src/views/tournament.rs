//! A tournament: its rules, who is in it, its rounds, its tables, and what comes next.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    views::{ruling, tournament_sheet::TournamentSheet},
};
use faceoff_api::views::{
    shown,
    tournament::{
        ByeView, EntrantView, LeaveView, RoundProgress, RoundSubmission, RoundView, TournamentHead,
        TournamentPhase, TournamentView,
    },
};
use faceoff_scoring::tournament::schedule::Table;
use faceoff_store::{Entrant, Game, GamePurpose, GameState, Leave, TournamentRound};
use faceoff_types::{RoundNumber, StageName, TeamId, TeamName, TournamentId};

/// All of the season, the first one first.
#[boxed]
pub async fn heads(app: &AppState) -> Result<Vec<TournamentHead>, Problem> {
    let mut heads = Vec::new();
    for tournament in app.store.tournaments().await? {
        let sheet = TournamentSheet::find(app, tournament.id).await?;
        heads.push(head(&sheet));
    }
    Ok(heads)
}

fn head(sheet: &TournamentSheet) -> TournamentHead {
    let tables = sheet.tables(sheet.played());
    head_with(sheet, &tables)
}

fn head_with(sheet: &TournamentSheet, tables: &[Table]) -> TournamentHead {
    let tournament = &sheet.tournament;
    let phase = phase(sheet);
    TournamentHead {
        id: tournament.id,
        number: tournament.number,
        name: tournament.name.clone(),
        phase,
        created_at: tournament.created_at,
        stage: tournament.stage,
        paused: tournament.paused.clone().map(ruling::of),
        closed_at: tournament.closed_at,
        champion: champion(sheet, tables),
        next: next(sheet, phase),
    }
}

/// One, with its rounds and tables.
#[boxed]
pub async fn find(app: &AppState, id: TournamentId) -> Result<TournamentView, Problem> {
    of(&TournamentSheet::find(app, id).await?)
}

/// One, with its rounds and tables.
pub fn of(sheet: &TournamentSheet) -> Result<TournamentView, Problem> {
    let tables = sheet.tables(sheet.played());
    let tournament = &sheet.tournament;
    let rounds = sheet.rounds.iter();
    Ok(TournamentView {
        head: head_with(sheet, &tables),
        rules: tournament.rules.clone(),
        settings: tournament.settings.clone(),
        baseline: tournament.baseline,
        entrants: sheet.entrants.iter().cloned().map(entrant).collect(),
        rounds: rounds
            .map(|round| round_of(sheet, round))
            .collect::<Result<_, _>>()?,
        tables,
    })
}

/// The tournaments that a team has entered, the first one first: ids and names.
#[boxed]
pub async fn entered_by(
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

/// A team that has entered.
pub fn entrant(entrant: Entrant) -> EntrantView {
    EntrantView {
        team: entrant.team,
        team_name: entrant.name,
        entered_at: entrant.entered_at,
        left: entrant.left.map(leave),
    }
}

/// How and when a team left.
pub fn leave(leave: Leave) -> LeaveView {
    LeaveView {
        r#as: leave.left_as,
        from_round: leave.from_round,
        at: leave.at,
        reason: shown(leave.reason),
    }
}

/// A round, and how far it is.
pub fn round_of(sheet: &TournamentSheet, round: &TournamentRound) -> Result<RoundView, Problem> {
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
        count(&mut progress, &game.state);
    }
    Ok(RoundView {
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

const fn count(progress: &mut RoundProgress, state: &GameState) {
    progress.games += 1;
    *match state {
        GameState::Queued => &mut progress.queued,
        GameState::Running { .. } => &mut progress.running,
        GameState::Played(_) => &mut progress.played,
        GameState::Broken { .. } | GameState::Void { .. } => &mut progress.to_be_rerun,
        GameState::Cancelled { .. } => &mut progress.cancelled,
    } += 1;
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
    awaited.for_each(|game| count(&mut progress, &game.state));
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
