//! `/tournaments/{id}/teams/{a}/{b}`: two teams side by side, and their games.

use super::{
    figures,
    frame::{Frame, PageProblem, render},
    game_row::GameRow,
    spoilers::Spoilers,
    tournament_words::is_drawn_from_results,
};
use askama::Template;
use axum::{
    extract::{FromRequestParts, State},
    http::request::Parts,
    response::Response,
};
use faceoff_api::views::game::{GameResultView, GameStatus};
use faceoff_service::{
    app::App,
    extract::PathParams,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{game, season::SeasonHead, tournament_sheet::TournamentSheet},
};
use faceoff_types::{TeamId, TeamName, TournamentId};
use std::{fmt::Display, str::FromStr};

/// Two teams of a tournament: the parameters `{id}`, `{a}` and `{b}` of the path.
pub(super) struct TwoTeams {
    tournament: TournamentId,
    teams: [TeamId; 2],
}

impl<S: Send + Sync> FromRequestParts<S> for TwoTeams {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let PathParams([id, a, b]) =
            PathParams::<String, 3>::from_request_parts(parts, state).await?;
        Ok(Self {
            tournament: parsed(&id)?,
            teams: [parsed(&a)?, parsed(&b)?],
        })
    }
}

/// What cannot be an id is the id of nothing.
fn parsed<T: FromStr<Err: Display>>(text: &str) -> Result<T, Problem> {
    text.parse()
        .map_err(|error: T::Err| Problem::new(ProblemKind::NotFound, error.to_string()))
}

/// A line of the table: what it counts, and each team's number.
struct Line {
    what: &'static str,
    teams: [String; 2],
}

/// A game's numbers, the page's first team first whoever is at home.
struct Numbers {
    game: GameRow,
    goals: String,
    fouls: String,
    penalty_points: String,
    mean_ms: String,
}

#[derive(Template)]
#[template(path = "head_to_head.html")]
struct Page {
    frame: Frame,
    spoilers: Spoilers,
    tournament: TournamentId,
    tournament_name: String,
    ids: [TeamId; 2],
    names: [TeamName; 2],
    /// Games with a result that counts.
    counted: usize,
    lines: Vec<Line>,
    games: Vec<GameRow>,
    numbers: Vec<Numbers>,
    has_halves: bool,
    /// Games of rounds that were drawn from results are left out.
    is_withheld: bool,
}

/// Two teams.
pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    spoilers: Spoilers,
    two: Result<TwoTeams, Problem>,
) -> Result<Response, PageProblem> {
    let TwoTeams { tournament, teams } = two?;
    let viewer = viewer?;
    let season = SeasonHead::now(&app).await?;
    let sheet = TournamentSheet::find(&app, tournament).await?;
    let is_in = |team: &TeamId| sheet.entrants.iter().any(|entrant| entrant.team == *team);
    if teams[0] == teams[1] || !teams.iter().all(is_in) {
        let detail = "two different teams of the tournament are put side by side, and one of these is not in it";
        return Err(Problem::new(ProblemKind::NotFound, detail).into());
    }
    let names = [sheet.name(teams[0])?, sheet.name(teams[1])?];
    let views = game::of_rounds(&sheet, viewer, None)?;
    let rules = &sheet.tournament.rules;
    let is_theirs = |row: &GameRow| teams.iter().all(|team| row.team_ids.contains(team));
    let mut is_withheld = false;
    let mut found = Vec::new();
    for view in &views {
        let Some(row) = GameRow::of(view, spoilers.hide()) else {
            continue;
        };
        // Whether they met there at all would tell of the rounds before.
        if is_drawn_from_results(rules, row.round) && !spoilers.tell_round(row.round) {
            is_withheld = true;
        } else if is_theirs(&row) {
            found.push((row, view));
        }
    }
    let played: Vec<(&GameRow, &GameResultView)> = found
        .iter()
        .filter(|_| !spoilers.hide())
        .filter_map(|(row, view)| match &view.status {
            GameStatus::Played { result, .. } => Some((row, &**result)),
            _ => None,
        })
        .collect();
    let counted: Vec<_> = played
        .iter()
        .filter(|(row, _)| row.taken_out_by.is_none())
        .copied()
        .collect();
    render(&Page {
        frame: Frame::of(&app, season.name, format!("/tournaments/{tournament}")),
        tournament,
        tournament_name: sheet.tournament.name.to_string(),
        ids: teams,
        counted: counted.len(),
        lines: lines(&counted, &names),
        numbers: played
            .iter()
            .map(|(row, result)| Numbers::of(row, result, teams[0]))
            .collect(),
        games: found.iter().map(|(row, _)| row.clone()).collect(),
        has_halves: rules.mirrored,
        names,
        is_withheld,
        spoilers,
    })
}

/// Both teams' numbers over the games that count.
fn lines(played: &[(&GameRow, &GameResultView)], names: &[TeamName; 2]) -> Vec<Line> {
    if played.is_empty() {
        return Vec::new();
    }
    let sum = |team: usize, of: &dyn Fn(&GameResultView, usize) -> f64| -> f64 {
        played
            .iter()
            .map(|(row, result)| of(result, side_of(row, &names[team])))
            .sum()
    };
    let both = |of: &dyn Fn(&GameResultView, usize) -> f64| [sum(0, of), sum(1, of)];
    let whole = |sums: [f64; 2]| sums.map(|sum| format!("{sum:.0}"));
    let won = |team: usize| {
        let those = played.iter();
        let those = those.filter(|(_, result)| result.winner.as_ref() == Some(&names[team]));
        those.count().to_string()
    };
    let drawn = played.iter().filter(|(_, result)| result.winner.is_none());
    let drawn = drawn.count().to_string();
    // Each game has as many answers as control steps, but for what was held.
    let steps: f64 = played
        .iter()
        .map(|(_, result)| f64::from(result.steps))
        .sum();
    let mean = both(&|result, side| result.computation_time_s[side].mean * f64::from(result.steps));
    let line = |what, teams| Line { what, teams };
    vec![
        line("Games won", [won(0), won(1)]),
        line("Games drawn", [drawn.clone(), drawn]),
        line(
            "Goals on the table",
            whole(both(&|result, side| f64::from(result.goals[side]))),
        ),
        line(
            "Fouls",
            whole(both(&|result, side| f64::from(result.fouls[side]))),
        ),
        line(
            "Penalty points",
            both(&|result, side| result.penalty_points[side]).map(figures::one),
        ),
        line(
            "Faults",
            whole(both(&|result, side| f64::from(result.faults[side]))),
        ),
        line(
            "Mean computation time, by control steps",
            mean.map(|sum| format!("{} ms", figures::milliseconds(sum / steps.max(1.0)))),
        ),
    ]
}

/// Which side of a game a team is.
fn side_of(game: &GameRow, team: &TeamName) -> usize {
    usize::from(game.teams[1] == *team)
}

impl Numbers {
    fn of(game: &GameRow, result: &GameResultView, first: TeamId) -> Self {
        let side = usize::from(game.team_ids[1] == first);
        let pair = |numbers: [String; 2]| {
            let [own, other] = [&numbers[side], &numbers[1 - side]];
            format!("{own} : {other}")
        };
        let times = &result.computation_time_s;
        Self {
            goals: pair(result.goals.map(|goals| goals.to_string())),
            fouls: pair(result.fouls.map(|fouls| fouls.to_string())),
            penalty_points: pair(result.penalty_points.map(figures::one)),
            mean_ms: pair([times[0].mean, times[1].mean].map(figures::milliseconds)),
            game: game.clone(),
        }
    }
}
