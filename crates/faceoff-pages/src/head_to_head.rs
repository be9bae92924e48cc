//! `/tournaments/{id}/teams/{a}/{b}`: comparison of two teams of a tournament, with their games.

use super::{
    format,
    frame::{Frame, PageProblem, render},
    game_row::GameRow,
    spoilers::Spoilers,
    tournament_text::is_drawn_from_results,
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
    extract::{PathParams, parse_path_param},
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{game, tournament_state::TournamentState},
};
use faceoff_types::{TeamId, TeamName, TournamentId};

/// The path parameters `{id}`, `{a}` and `{b}`.
pub(super) struct TeamPairPath {
    tournament: TournamentId,
    teams: [TeamId; 2],
}

impl<S: Send + Sync> FromRequestParts<S> for TeamPairPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let PathParams([id, a, b]) =
            PathParams::<String, 3>::from_request_parts(parts, state).await?;
        Ok(Self {
            tournament: parse_path_param(&id)?,
            teams: [parse_path_param(&a)?, parse_path_param(&b)?],
        })
    }
}

/// A row of the table of statistics.
struct Statistic {
    name: &'static str,
    teams: [String; 2],
}

/// Statistics of a game as pairs; the first team of the page comes first, home or away.
struct GameStatistics {
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
    /// Number of played games that count. Those that the departure of a team excluded from the standings do not.
    counted: usize,
    statistics: Vec<Statistic>,
    games: Vec<GameRow>,
    game_statistics: Vec<GameStatistics>,
    /// Does each pairing play a mirrored pair of games?
    has_mirrored_pairs: bool,
    /// Are rounds omitted whose pairings would reveal hidden results?
    has_hidden_rounds: bool,
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    spoilers: Spoilers,
    path: Result<TeamPairPath, Problem>,
) -> Result<Response, PageProblem> {
    let TeamPairPath { tournament, teams } = path?;
    let viewer = viewer?;
    let state = TournamentState::find(&app, tournament).await?;
    let is_entered = |team: &TeamId| state.entrants.iter().any(|entrant| entrant.team == *team);
    if teams[0] == teams[1] || !teams.iter().all(is_entered) {
        let detail = "expected two different teams of the tournament, got the same team twice or a team that is not in it";
        return Err(Problem::new(ProblemKind::NotFound, detail).into());
    }
    let names = [state.name(teams[0])?, state.name(teams[1])?];
    let views = game::round_games(&state, viewer, None)?;
    let rules = &state.tournament.rules;
    let has_both_teams = |row: &GameRow| teams.iter().all(|team| row.team_ids.contains(team));
    let mut has_hidden_rounds = false;
    let mut common_games = Vec::new();
    for view in &views {
        let Some(row) = GameRow::new(view, spoilers.result_display()) else {
            continue;
        };
        // Even the fact that the teams met would reveal results of earlier rounds.
        if is_drawn_from_results(rules, row.round) && !spoilers.shows_round(row.round) {
            has_hidden_rounds = true;
        } else if has_both_teams(&row) {
            common_games.push((row, view));
        }
    }
    let played: Vec<(&GameRow, &GameResultView)> = common_games
        .iter()
        .filter(|_| !spoilers.hides_results())
        .filter_map(|(row, view)| match &view.status {
            GameStatus::Played { result, .. } => Some((row, &**result)),
            _ => None,
        })
        .collect();
    let counted: Vec<_> = played
        .iter()
        .filter(|(row, _)| row.departed_team.is_none())
        .copied()
        .collect();
    render(&Page {
        frame: Frame::load(&app, format!("/tournaments/{tournament}")).await?,
        tournament,
        tournament_name: state.tournament.name.to_string(),
        ids: teams,
        counted: counted.len(),
        statistics: statistics(&counted, &names),
        game_statistics: played
            .iter()
            .map(|(row, result)| GameStatistics::new(row, result, teams[0]))
            .collect(),
        games: common_games.iter().map(|(row, _)| row.clone()).collect(),
        has_mirrored_pairs: rules.mirrored,
        names,
        has_hidden_rounds,
        spoilers,
    })
}

/// Statistics of both teams over the games that count.
fn statistics(played: &[(&GameRow, &GameResultView)], names: &[TeamName; 2]) -> Vec<Statistic> {
    if played.is_empty() {
        return Vec::new();
    }
    let sum = |team: usize, value: &dyn Fn(&GameResultView, usize) -> f64| -> f64 {
        played
            .iter()
            .map(|(row, result)| value(result, side_of(row, &names[team])))
            .sum()
    };
    let sums = |value: &dyn Fn(&GameResultView, usize) -> f64| [sum(0, value), sum(1, value)];
    let whole_numbers = |values: [f64; 2]| values.map(|value| format!("{value:.0}"));
    let won = |team: usize| {
        let won = played
            .iter()
            .filter(|(_, result)| result.winner.as_ref() == Some(&names[team]));
        won.count().to_string()
    };
    let drawn = played.iter().filter(|(_, result)| result.winner.is_none());
    let drawn = drawn.count().to_string();
    // The mean over all answers: games are weighted by control steps, since a game has about one answer per step.
    let steps: f64 = played
        .iter()
        .map(|(_, result)| f64::from(result.steps))
        .sum();
    let weighted_times =
        sums(&|result, side| result.computation_time_s[side].mean * f64::from(result.steps));
    let statistic = |name, teams| Statistic { name, teams };
    vec![
        statistic("Games won", [won(0), won(1)]),
        statistic("Games drawn", [drawn.clone(), drawn]),
        statistic(
            "Goals on the table",
            whole_numbers(sums(&|result, side| f64::from(result.goals[side]))),
        ),
        statistic(
            "Fouls",
            whole_numbers(sums(&|result, side| f64::from(result.fouls[side]))),
        ),
        statistic(
            "Penalty points",
            sums(&|result, side| result.penalty_points[side]).map(format::one_decimal),
        ),
        statistic(
            "Faults",
            whole_numbers(sums(&|result, side| f64::from(result.faults[side]))),
        ),
        statistic(
            "Mean computation time",
            weighted_times.map(|sum| format!("{} ms", format::milliseconds(sum / steps.max(1.0)))),
        ),
    ]
}

/// Which side of a game a team is.
fn side_of(game: &GameRow, team: &TeamName) -> usize {
    usize::from(game.teams[1] == *team)
}

impl GameStatistics {
    fn new(game: &GameRow, result: &GameResultView, first: TeamId) -> Self {
        let side = usize::from(game.team_ids[1] == first);
        let pair = |numbers: [String; 2]| {
            let [own, other] = [&numbers[side], &numbers[1 - side]];
            format!("{own} : {other}")
        };
        let times = &result.computation_time_s;
        Self {
            goals: pair(result.goals.map(|goals| goals.to_string())),
            fouls: pair(result.fouls.map(|fouls| fouls.to_string())),
            penalty_points: pair(result.penalty_points.map(format::one_decimal)),
            mean_ms: pair([times[0].mean, times[1].mean].map(format::milliseconds)),
            game: game.clone(),
        }
    }
}
