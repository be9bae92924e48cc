//! Tables of a tournament.

use super::scored_tournament::ScoredTournament;
use anyhow::Context as _;
use faceoff_scoring::tournament::{
    DepartureKind, HeadToHead, ScoredGame, StandingsRow,
    rating::{Pool, Ratings},
};
use std::{
    fmt::{self, Write as _},
    io::Write,
};

/// Writes games, standings, records and ratings.
pub fn write(out: &mut impl Write, scored: &ScoredTournament) -> anyhow::Result<()> {
    let mut text = String::new();
    write_tables(&mut text, scored).expect("writing to memory cannot fail");
    out.write_all(text.as_bytes()).context("standard output")
}

pub(in crate::commands) fn standings_table(rows: &[StandingsRow]) -> String {
    let mut out = String::new();
    write_standings(&mut out, rows).expect("writing to memory cannot fail");
    out
}

/// Head-to-head records and ratings.
pub(in crate::commands) fn ratings_text(rated: &Ratings, records: &[HeadToHead]) -> String {
    let mut out = String::new();
    write_records(&mut out, records)
        .and_then(|()| write_ratings(&mut out, rated))
        .expect("writing to memory cannot fail");
    out.trim().to_owned()
}

fn write_tables(out: &mut String, scored: &ScoredTournament) -> std::fmt::Result {
    write_games(out, &scored.tournament.games)?;
    write_standings(out, &scored.tournament.standings)?;
    write_records(out, &scored.head_to_head)?;
    if let Some(ratings) = &scored.ratings {
        write_ratings(out, ratings)?;
    }
    Ok(())
}

/// The width of a column in characters.
fn column_width<'a>(heading: &str, cells: impl Iterator<Item = &'a str>) -> usize {
    cells
        .map(|cell| cell.chars().count())
        .fold(heading.chars().count(), usize::max)
}

/// Two numbers, e.g. the goals of both sides, as `3-1`.
fn hyphenated<T: fmt::Display>([first, second]: [T; 2]) -> String {
    format!("{first}-{second}")
}

fn write_games(out: &mut String, games: &[ScoredGame]) -> std::fmt::Result {
    let teams = |side: usize| games.iter().map(move |game| game.teams()[side].as_str());
    let (home, away) = (
        column_width("home", teams(0)),
        column_width("away", teams(1)),
    );
    let winner = column_width("winner", teams(0).chain(teams(1)));
    writeln!(
        out,
        "{:>5}  {:<home$}  {:<away$}  {:>7}  {:>7}  {:>7}  {:>15}  {:<winner$}  reason",
        "round", "home", "away", "score", "goals", "fouls", "penalty points", "winner"
    )?;
    for game in games {
        let [first, second] = game.teams();
        let points = game.penalty_points().map(|points| format!("{points:.1}"));
        write!(
            out,
            "{:>5}  {first:<home$}  {second:<away$}  {:>7}  {:>7}  {:>7}  {:>15}  {:<winner$}  {}",
            game.round(),
            hyphenated(game.score),
            hyphenated(game.goals()),
            game.fouls().map_or_else(|| "?".to_owned(), hyphenated),
            points.join(" / "),
            game.winner.as_ref().map_or("draw", |team| team.as_str()),
            game.result
        )?;
        match &game.excluded_by {
            Some(team) => writeln!(out, " (does not count: {team} left)")?,
            None => writeln!(out)?,
        }
    }
    Ok(())
}

fn write_standings(out: &mut String, standings: &[StandingsRow]) -> std::fmt::Result {
    let names = standings.iter().map(|row| row.team.as_str());
    let team = column_width("team", names);
    writeln!(
        out,
        "\n{:>4}  {:<team$}  {:>6}  {:>4}  {:>5}  {:>6}  {:>9}  {:>14}  points per round",
        "rank", "team", "points", "wins", "draws", "losses", "goals", "penalty points"
    )?;
    for row in standings {
        let rounds: Vec<_> = row.points_per_round.iter().map(u32::to_string).collect();
        write!(
            out,
            "{:>4}  {:<team$}  {:>6}  {:>4}  {:>5}  {:>6}  {:>9}  {:>14.1}  {}",
            row.rank,
            row.team,
            row.points,
            row.wins,
            row.draws,
            row.losses,
            hyphenated([row.goals_for, row.goals_against]),
            row.penalty_points,
            rounds.join(" + ")
        )?;
        match row.departure {
            Some(DepartureKind::Withdrawn) => writeln!(out, " (withdrawn)")?,
            Some(DepartureKind::Disqualified) => writeln!(out, " (disqualified)")?,
            None => writeln!(out)?,
        }
    }
    Ok(())
}

fn write_records(out: &mut String, records: &[HeadToHead]) -> std::fmt::Result {
    let names = |side: usize| {
        records
            .iter()
            .map(move |record| record.teams[side].as_str())
    };
    let (first, second) = (column_width("A", names(0)), column_width("B", names(1)));
    writeln!(
        out,
        "\n{:<first$}  {:<second$}  {:>6}  {:>5}  {:>6}  {:>9}",
        "A", "B", "A wins", "draws", "B wins", "goals"
    )?;
    for record in records {
        let [a, b] = &record.teams;
        writeln!(
            out,
            "{a:<first$}  {b:<second$}  {:>6}  {:>5}  {:>6}  {:>9}",
            record.wins[0],
            record.draws,
            record.wins[1],
            hyphenated(record.goals)
        )?;
    }
    Ok(())
}

fn write_ratings(out: &mut String, ratings: &Ratings) -> std::fmt::Result {
    for (basis, pools) in [("results", &ratings.results), ("goals", &ratings.goals)] {
        for (number, pool) in (1..).zip(pools) {
            write!(out, "\nratings by {basis}")?;
            if pools.len() > 1 {
                write!(
                    out,
                    ", pool {number} of {} (the pools have no games against each other)",
                    pools.len()
                )?;
            }
            writeln!(out)?;
            write_pool(out, pool)?;
        }
    }
    writeln!(
        out,
        "\nBradley-Terry, a difference of 400 points means odds of 10 to 1; prior {} ± {}; interval: bootstrap over games, {} samples",
        ratings.prior.mean, ratings.prior.sd, ratings.resamples
    )
}

/// The ratings of a *pool*, teams or submissions that games connect with each other.
fn write_pool(out: &mut String, pool: &Pool) -> std::fmt::Result {
    let names: Vec<String> = pool
        .ratings
        .iter()
        .map(|row| match &row.rated.submission {
            Some(submission) => format!("{} ({submission})", row.rated.team),
            None => row.rated.team.to_string(),
        })
        .collect();
    let name_width = column_width("team", names.iter().map(String::as_str));
    writeln!(
        out,
        "{:<name_width$}  {:>6}  {:>15}  {:>5}",
        "team", "rating", "95 % interval", "games"
    )?;
    for (name, row) in names.iter().zip(&pool.ratings) {
        let interval = match row.ci95 {
            [Some(low), Some(high)] => format!("{low:.0} to {high:.0}"),
            [Some(low), None] => format!("above {low:.0}"),
            [None, Some(high)] => format!("below {high:.0}"),
            [None, None] => "unknown".to_owned(),
        };
        writeln!(
            out,
            "{name:<name_width$}  {:>6.0}  {interval:>15}  {:>5}",
            row.rating, row.games
        )?;
    }
    Ok(())
}
