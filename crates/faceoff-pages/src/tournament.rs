//! `/tournaments/{id}`: standings, cross table, schedule, ratings and entrants of a tournament.

mod cross_table;
mod entrants;
mod ratings;
mod schedule;
mod standings;

use super::{
    frame::{Frame, PageProblem, render},
    game_row::GameRow,
    spoilers::Spoilers,
    tournament_text,
};
use askama::Template;
use axum::{extract::State, response::Response};
use cross_table::CrossTable;
use entrants::Entrant;
use faceoff_api::views::{champion_shares::ChampionSharesView, tournament::TournamentView};
use faceoff_scoring::tournament::schedule::TableScope;
use faceoff_service::{
    app::App,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{
        game, ratings::ratings, schedule_replays::champion_shares, tournament,
        tournament_state::TournamentState,
    },
};
use faceoff_types::{RoundNumber, TeamId, TeamName, TournamentId};
use ratings::RatingTable;
use schedule::Round;
use standings::Standings;
use std::collections::BTreeMap;

/// The section of the ratings.
enum RatingsSection {
    Tables(Vec<RatingTable>),
    /// Why there are no ratings.
    None(String),
}

#[derive(Template)]
#[template(path = "tournament.html")]
struct Page {
    frame: Frame,
    spoilers: Spoilers,
    id: TournamentId,
    view: TournamentView,
    phase: String,
    format: String,
    /// Are the standings final?
    is_final: bool,
    running: Vec<GameRow>,
    standings: Vec<Standings>,
    /// Teams without a result, which are not in the standings yet.
    unplayed: Vec<TeamName>,
    cross_tables: Vec<CrossTable>,
    /// Pairs of teams with a game: path of their page, and their names.
    pairs: Vec<(String, String)>,
    /// The newest first.
    rounds: Vec<Round>,
    ratings: RatingsSection,
    champion_shares: Option<ChampionShares>,
    entrants: Vec<Entrant>,
}

/// How often each team became champion when the whole schedule was repeated with other seeds.
struct ChampionShares {
    summary: String,
    /// Team, number of first places, their share in percent, 95 % interval of the share.
    champions: Vec<(TeamName, u32, String, String)>,
}

impl Page {
    /// The next step. If results are hidden, it leaves out the reason of a pause: a free text that may reveal them.
    fn next_step(&self) -> &str {
        match self.spoilers.hides_results() && self.view.summary.paused.is_some() {
            true => "The tournament is paused; no games start.",
            false => &self.view.summary.next,
        }
    }

    /// Text for screen readers after a live update.
    fn live_text(&self) -> String {
        if self.spoilers.hides_results() {
            return String::new();
        }
        let first = self.standings.first().and_then(|table| table.rows.first());
        match first {
            Some(first) => format!(
                "The tournament has changed. First: {}, {} points.",
                first.team, first.points
            ),
            None => String::new(),
        }
    }
}

pub(super) async fn page(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    spoilers: Spoilers,
    id: Result<PathParam<TournamentId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let viewer = viewer?;
    let state = TournamentState::find(&app, id).await?;
    let view = tournament::view(&state)?;
    let is_hidden = spoilers.hides_results();
    let games: Vec<GameRow> = game::round_games(&state, viewer, None)?
        .iter()
        .filter_map(|game| GameRow::new(game, spoilers.result_display()))
        .collect();
    let visible_games: Vec<&GameRow> = games
        .iter()
        .filter(|game| !schedule::is_hidden(&view, game.round, &spoilers))
        .collect();
    let standings = match is_hidden {
        true => Vec::new(),
        false => view
            .tables
            .iter()
            .map(|table| Standings::new(&state, table))
            .collect::<Result<_, _>>()?,
    };
    let ratings = match is_hidden {
        true => RatingsSection::None(String::new()),
        false => ratings_section(&app, &view).await?,
    };
    let unplayed = view.entrants.iter().filter(|entrant| {
        let is_listed =
            |table: &Standings| table.rows.iter().any(|row| row.team_id == entrant.team);
        !is_hidden && entrant.departure.is_none() && !standings.iter().any(is_listed)
    });
    let page = Page {
        frame: Frame::load(&app, format!("/tournaments/{id}"))
            .await?
            .with_address(&app, &format!("/tournaments/{id}")),
        id,
        phase: tournament_text::phase_label(&view.summary),
        format: tournament_text::describe_format(&view.rules),
        is_final: view.summary.champion.is_some(),
        running: visible_games
            .iter()
            .filter(|game| game.is_running())
            .map(|game| GameRow::clone(game))
            .collect(),
        unplayed: unplayed.map(|entrant| entrant.team_name.clone()).collect(),
        cross_tables: cross_tables(&state, &view, &visible_games, is_hidden)?,
        pairs: pairs(id, &visible_games),
        rounds: view
            .rounds
            .iter()
            .rev()
            .map(|round| Round::new(&view, round, &games, &spoilers))
            .collect(),
        ratings,
        champion_shares: match is_hidden {
            true => None,
            false => ChampionShares::new(&*champion_shares(&app, id).await?),
        },
        entrants: entrants::entrants(&app, &view, &spoilers).await?,
        standings,
        spoilers,
        view,
    };
    render(&page)
}

async fn ratings_section(app: &App, view: &TournamentView) -> Result<RatingsSection, Problem> {
    let rated = match ratings(app, view.summary.id).await {
        // There are no ratings; the problem says why.
        Err(problem) if problem.kind() == ProblemKind::Conflict => {
            return Ok(RatingsSection::None(problem.detail().to_owned()));
        }
        rated => rated?,
    };
    let rounds_by_submission = entrants::rounds_by_submission(view);
    let tables = ratings::tables(&rated, &rounds_by_submission);
    Ok(match tables.is_empty() {
        true => RatingsSection::None("No finished games yet.".to_owned()),
        false => RatingsSection::Tables(tables),
    })
}

/// A cross table of all teams, or one for the final and one for each group. With hidden results teams are sorted by name,
/// because their ranks would reveal results.
fn cross_tables(
    state: &TournamentState,
    view: &TournamentView,
    games: &[&GameRow],
    is_hidden: bool,
) -> Result<Vec<CrossTable>, Problem> {
    let mut cross_tables = Vec::new();
    for table in &view.tables {
        let round_games = |round: RoundNumber| {
            let matching = games
                .iter()
                .copied()
                .filter(move |game| game.round == round);
            matching.collect::<Vec<_>>()
        };
        let table_games = match table.scope {
            TableScope::Tournament => games.to_vec(),
            TableScope::Group(_) => round_games(RoundNumber::FIRST),
            TableScope::Final => round_games(RoundNumber::SECOND),
        };
        let ranked = table.standings.iter().map(|standing| {
            let id = state.team(&standing.team)?;
            Ok((id, standing.team.clone()))
        });
        let mut teams = ranked.collect::<Result<Vec<(TeamId, TeamName)>, Problem>>()?;
        add_unranked(&mut teams, table.scope, &table_games);
        if is_hidden {
            teams.sort_by(|(_, a), (_, b)| a.cmp(b));
        }
        // Pairings of hidden games are hidden, too.
        if table.scope == TableScope::Final && table_games.is_empty() {
            continue;
        }
        cross_tables.push(CrossTable::new(
            standings::title(table.scope),
            &teams,
            &table_games,
        ));
    }
    cross_tables.retain(|table| table.rows.len() > 1);
    Ok(cross_tables)
}

/// Pairs of teams with a game, sorted by name.
fn pairs(id: TournamentId, games: &[&GameRow]) -> Vec<(String, String)> {
    let mut pairs = BTreeMap::new();
    for game in games {
        let mut named_ids: Vec<_> = game.teams.iter().zip(&game.team_ids).collect();
        named_ids.sort();
        if let [(a, first), (b, second)] = named_ids[..] {
            let path = format!("/tournaments/{id}/teams/{first}/{second}");
            pairs.insert((a, b), (path, format!("{a} and {b}")));
        }
    }
    pairs.into_values().collect()
}

/// Appends teams that have a game but no rank yet. The standings of a group list all its teams from the start.
fn add_unranked(teams: &mut Vec<(TeamId, TeamName)>, scope: TableScope, games: &[&GameRow]) {
    if matches!(scope, TableScope::Group(_)) {
        return;
    }
    let mut unranked = Vec::new();
    for game in games {
        for (id, name) in game.team_ids.iter().zip(&game.teams) {
            let is_listed = |(other, _): &(TeamId, TeamName)| other == id;
            if !teams.iter().any(is_listed) && !unranked.iter().any(is_listed) {
                unranked.push((*id, name.clone()));
            }
        }
    }
    unranked.sort_by(|(_, a), (_, b)| a.cmp(b));
    teams.extend(unranked);
}

impl ChampionShares {
    fn new(view: &ChampionSharesView) -> Option<Self> {
        if view.replays == 0 {
            return None;
        }
        let champions = view.champions.iter().map(|share| {
            let percent = |share: f64| super::format::one_decimal(100.0 * share);
            let [low, high] = share.share_ci95.map(percent);
            (
                share.team.clone(),
                share.first_places,
                percent(share.share),
                format!("{low} – {high}"),
            )
        });
        Some(Self {
            summary: format!(
                "The schedule is repeated {} times with new seeds and the same submissions; {} repetitions are complete \
                 ({} of {} games). These games do not count.",
                view.replays, view.complete, view.games_played, view.games
            ),
            champions: champions.collect(),
        })
    }
}
