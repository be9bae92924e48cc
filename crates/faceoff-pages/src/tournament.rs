//! `/tournaments/{id}`: standings, who met whom, who plays whom when, ratings, and with what everybody plays.

mod cross;
mod entrants;
mod ratings;
mod schedule;
mod standings;

use super::{
    frame::{Frame, PageProblem, render},
    game_row::GameRow,
    spoilers::Spoilers,
    tournament_words,
};
use askama::Template;
use axum::{extract::State, response::Response};
use cross::Cross;
use entrants::Entrant;
use faceoff_api::views::{certainty::CertaintyView, tournament::TournamentView};
use faceoff_scoring::tournament::schedule::TableOf;
use faceoff_service::{
    app::App,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{
        game, ratings::ratings, replays::certainty, season::SeasonHead, tournament,
        tournament_sheet::TournamentSheet,
    },
};
use faceoff_types::{RoundNumber, TeamId, TeamName, TournamentId};
use ratings::RatingTable;
use schedule::Round;
use standings::Standings;
use std::collections::BTreeMap;

/// How strong the submissions are.
enum Strengths {
    Tables(Vec<RatingTable>),
    /// Why there are none.
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
    /// Is the table as it stays?
    is_final: bool,
    /// Games that are being played.
    running: Vec<GameRow>,
    standings: Vec<Standings>,
    /// Teams that are in no table, since no game of theirs has a result.
    unplayed: Vec<TeamName>,
    crosses: Vec<Cross>,
    /// Each two teams that meet: the path of their page, and their names.
    pairs: Vec<(String, String)>,
    /// The newest first.
    rounds: Vec<Round>,
    strengths: Strengths,
    certainty: Option<Certainty>,
    entrants: Vec<Entrant>,
}

/// How often each team was champion when the schedule was played again.
struct Certainty {
    told: String,
    /// Team, times, percent, interval.
    champions: Vec<(TeamName, u32, String, String)>,
}

impl Page {
    /// What comes next; a pause's reason is the organiser's own words.
    fn next(&self) -> &str {
        match self.spoilers.hide() && self.view.head.paused.is_some() {
            true => "No game begins: the tournament is paused.",
            false => &self.view.head.next,
        }
    }

    /// What has changed, in a sentence.
    fn told(&self) -> String {
        if self.spoilers.hide() {
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
    let season = SeasonHead::now(&app).await?;
    let sheet = TournamentSheet::find(&app, id).await?;
    let view = tournament::of(&sheet)?;
    let is_hidden = spoilers.hide();
    let games: Vec<GameRow> = game::of_rounds(&sheet, viewer, None)?
        .iter()
        .filter_map(|game| GameRow::of(game, is_hidden))
        .collect();
    let told: Vec<&GameRow> = games
        .iter()
        .filter(|game| !schedule::is_withheld(&view, game.round, &spoilers))
        .collect();
    let standings = match is_hidden {
        true => Vec::new(),
        false => view
            .tables
            .iter()
            .map(|table| Standings::of(&sheet, table))
            .collect::<Result<_, _>>()?,
    };
    let strengths = match is_hidden {
        true => Strengths::None(String::new()),
        false => strengths(&app, &view).await?,
    };
    let unplayed = view.entrants.iter().filter(|entrant| {
        let is_in = |table: &Standings| table.rows.iter().any(|row| row.team_id == entrant.team);
        !is_hidden && entrant.left.is_none() && !standings.iter().any(is_in)
    });
    let page = Page {
        frame: Frame::of(&app, season.name, format!("/tournaments/{id}")),
        id,
        phase: tournament_words::phase(&view.head),
        format: tournament_words::format(&view.rules),
        is_final: view.head.champion.is_some(),
        running: told
            .iter()
            .filter(|game| game.is_running())
            .map(|game| GameRow::clone(game))
            .collect(),
        unplayed: unplayed.map(|entrant| entrant.team_name.clone()).collect(),
        crosses: crosses(&sheet, &view, &told, is_hidden)?,
        pairs: pairs(id, &told),
        rounds: view
            .rounds
            .iter()
            .rev()
            .map(|round| Round::of(&view, round, &games, &spoilers))
            .collect(),
        strengths,
        certainty: match is_hidden {
            true => None,
            false => Certainty::of(&*certainty(&app, id).await?),
        },
        entrants: entrants::of(&app, &view, &spoilers).await?,
        standings,
        spoilers,
        view,
    };
    render(&page)
}

async fn strengths(app: &App, view: &TournamentView) -> Result<Strengths, Problem> {
    let rated = match ratings(app, view.head.id).await {
        Err(problem) if problem.kind() == ProblemKind::Conflict => {
            return Ok(Strengths::None(problem.detail().to_owned()));
        }
        rated => rated?,
    };
    let rounds = entrants::rounds_by_submission(view);
    let tables = ratings::tables(&rated, &rounds);
    Ok(match tables.is_empty() {
        true => Strengths::None("No game that counts has a result yet.".to_owned()),
        false => Strengths::Tables(tables),
    })
}

/// One of all teams, or one of the final and of each group. Whose results are hidden has the teams by name: their places
/// would tell of them.
fn crosses(
    sheet: &TournamentSheet,
    view: &TournamentView,
    games: &[&GameRow],
    is_hidden: bool,
) -> Result<Vec<Cross>, Problem> {
    let mut crosses = Vec::new();
    for table in &view.tables {
        let of_round = |wanted: RoundNumber| {
            let those = games
                .iter()
                .copied()
                .filter(move |game| game.round == wanted);
            those.collect::<Vec<_>>()
        };
        let own = match table.of {
            TableOf::Tournament => games.to_vec(),
            TableOf::Group(_) => of_round(RoundNumber::FIRST),
            TableOf::Final => of_round(RoundNumber::SECOND),
        };
        let placed = table.standings.iter().map(|standing| {
            let id = sheet.team(&standing.team)?;
            Ok((id, standing.team.clone()))
        });
        let mut teams = placed.collect::<Result<Vec<(TeamId, TeamName)>, Problem>>()?;
        add_unplayed(&mut teams, table.of, &own);
        if is_hidden {
            teams.sort_by(|(_, a), (_, b)| a.cmp(b));
        }
        // Of hidden games nobody is told who plays.
        if table.of == TableOf::Final && own.is_empty() {
            continue;
        }
        crosses.push(Cross::of(standings::title(table.of), &teams, &own));
    }
    crosses.retain(|cross| cross.rows.len() > 1);
    Ok(crosses)
}

/// Each two teams of some games once, by name.
fn pairs(id: TournamentId, games: &[&GameRow]) -> Vec<(String, String)> {
    let mut pairs = BTreeMap::new();
    for game in games {
        let mut both: Vec<_> = game.teams.iter().zip(&game.team_ids).collect();
        both.sort();
        if let [(a, first), (b, second)] = both[..] {
            let path = format!("/tournaments/{id}/teams/{first}/{second}");
            pairs.insert((a, b), (path, format!("{a} and {b}")));
        }
    }
    pairs.into_values().collect()
}

/// Those that have a game and no place yet.
fn add_unplayed(teams: &mut Vec<(TeamId, TeamName)>, of: TableOf, games: &[&GameRow]) {
    if matches!(of, TableOf::Group(_)) {
        return;
    }
    let mut others = Vec::new();
    for game in games {
        for (id, name) in game.team_ids.iter().zip(&game.teams) {
            let is_there = |(other, _): &(TeamId, TeamName)| other == id;
            if !teams.iter().any(is_there) && !others.iter().any(is_there) {
                others.push((*id, name.clone()));
            }
        }
    }
    others.sort_by(|(_, a), (_, b)| a.cmp(b));
    teams.extend(others);
}

impl Certainty {
    fn of(view: &CertaintyView) -> Option<Self> {
        if view.replays == 0 {
            return None;
        }
        let champions = view.champions.iter().map(|share| {
            let percent = |share: f64| super::figures::one(100.0 * share);
            let [low, high] = share.share_ci95.map(percent);
            (
                share.team.clone(),
                share.first_places,
                percent(share.share),
                format!("{low} – {high}"),
            )
        });
        Some(Self {
            told: format!(
                "The schedule was ordered to be played {} times more, with fresh seeds and the same submissions; {} of them \
                 are complete ({} of {} games). These games count nowhere.",
                view.replays, view.complete, view.games_played, view.games
            ),
            champions: champions.collect(),
        })
    }
}
