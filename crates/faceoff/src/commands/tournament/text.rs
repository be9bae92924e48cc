//! Text of tournaments.

use crate::commands::{
    output::{lines_or, time_text},
    score::table,
};
use faceoff_api::views::{
    champion_shares::ChampionSharesView,
    tournament::{EntrantView, RoundView, TournamentPhase, TournamentSummary, TournamentView},
};
use faceoff_scoring::tournament::schedule::{Table, TableScope};
use faceoff_types::{DepartureKind, Publication, RoundNumber, TournamentFormat, TournamentRules};

pub(in crate::commands) fn tournament_list(tournaments: &[TournamentSummary]) -> String {
    let line = |summary: &TournamentSummary| {
        format!(
            "{}  {}  {}: {}",
            summary.id,
            summary.name,
            phase_text(summary),
            summary.next
        )
    };
    lines_or(
        tournaments.iter().map(line).collect(),
        "no tournaments yet; organisers open one with faceoff admin tournament open NAME",
    )
}

fn phase_text(summary: &TournamentSummary) -> String {
    let phase = match summary.phase {
        TournamentPhase::Open => "open",
        TournamentPhase::RoundRunning => "round running",
        TournamentPhase::BetweenRounds => "between rounds",
        TournamentPhase::AllRoundsPlayed => "all rounds finished",
        TournamentPhase::Closed => "closed",
    };
    let paused = match (&summary.paused, summary.phase) {
        (Some(_), phase) if phase != TournamentPhase::Closed => ", paused",
        _ => "",
    };
    let champion = match &summary.champion {
        Some(team) => format!(", champion {team}"),
        None => String::new(),
    };
    format!("{phase}{paused}{champion}")
}

/// A tournament with rules, teams, rounds and standings.
pub(in crate::commands) fn tournament_text(tournament: &TournamentView) -> String {
    let summary = &tournament.summary;
    let settings = &tournament.settings;
    let mut lines = vec![
        format!("{} ({})", summary.name, phase_text(summary)),
        format!("  id        {}", summary.id),
        format!("  rules     {}", rules_text(&tournament.rules)),
        format!(
            "  settings  up to {} friendly and test games per team and day; recordings {}",
            settings.test_and_friendly_games_per_day,
            match settings.publishes {
                Publication::Never => "not public",
                Publication::AtClose => "public when the tournament is closed",
                Publication::AtRelease => "public when their round has finished",
            }
        ),
        match tournament.baseline {
            Some(submission) => format!("  baseline  submission {submission}"),
            None => "  baseline  none, so test games are not possible".to_owned(),
        },
    ];
    lines.extend(summary.paused.as_ref().map(|paused| {
        format!(
            "  paused    since {}: {}",
            time_text(paused.at),
            paused.reason
        )
    }));
    if tournament.entrants.is_empty() {
        lines.push("  teams     none; enter them with `faceoff admin tournament enter`".to_owned());
    }
    for (number, entrant) in tournament.entrants.iter().enumerate() {
        let title = if number == 0 { "teams" } else { "" };
        lines.push(format!("  {title:<8}  {}", entrant_text(entrant)));
    }
    lines.extend(tournament.rounds.iter().map(round_text));
    lines.push(format!("  next      {}", summary.next));
    let tables = tournament.tables.iter();
    let tables: String = tables
        .filter(|table| !table.standings.is_empty())
        .map(standings_text)
        .collect();
    lines.join("\n") + tables.trim_end()
}

fn rules_text(rules: &TournamentRules) -> String {
    let format = match &rules.format {
        TournamentFormat::RoundRobin { rounds } => {
            format!("{}, round robin", round_count(*rounds))
        }
        TournamentFormat::Groups { groups, advance } => {
            format!("{groups} groups, {advance} of each reach the final round")
        }
        TournamentFormat::Swiss { rounds } => format!("{}, Swiss system", round_count(*rounds)),
    };
    let mirrored = if rules.mirrored {
        ", mirrored pairs"
    } else {
        ""
    };
    format!(
        "{format}{mirrored}; {} control steps per game, {} ({})",
        rules.steps, rules.profile, rules.ruleset
    )
}

fn round_count(rounds: RoundNumber) -> String {
    match rounds.get() {
        1 => "one round".to_owned(),
        count => format!("{count} rounds"),
    }
}

fn entrant_text(entrant: &EntrantView) -> String {
    match &entrant.departure {
        None => entrant.team_name.to_string(),
        Some(departure) => {
            let kind = match departure.kind {
                DepartureKind::Withdrawn => "withdrawn",
                DepartureKind::Disqualified => "disqualified",
            };
            format!(
                "{} ({kind} from round {}: {})",
                entrant.team_name, departure.from_round, departure.reason
            )
        }
    }
}

/// A round in one or several lines.
pub(in crate::commands) fn round_text(round: &RoundView) -> String {
    let progress = &round.progress;
    let mut parts = vec![format!(
        "{} of {} games played",
        progress.played, progress.games
    )];
    for (count, state) in [
        (progress.running, "running"),
        (progress.queued, "queued"),
        (progress.to_be_rerun, "to be repeated"),
        (progress.cancelled, "cancelled"),
    ] {
        if count > 0 {
            parts.push(format!("{count} {state}"));
        }
    }
    let end = match round.ended_at {
        Some(at) => format!(", finished {}", time_text(at)),
        None => String::new(),
    };
    let mut text = format!(
        "  round {:<3} started {}{end}: {}",
        round.number.get(),
        time_text(round.started_at),
        parts.join(", ")
    );
    for (number, group) in (1..).zip(&round.groups) {
        let names: Vec<_> = group.iter().map(ToString::to_string).collect();
        text.push_str(&format!(
            "\n            group {number}: {}",
            names.join(", ")
        ));
    }
    for bye in &round.byes {
        text.push_str(&format!(
            "\n            matchday {}: bye for {}",
            bye.matchday, bye.team_name
        ));
    }
    text
}

fn standings_text(standings: &Table) -> String {
    let heading = match standings.scope {
        TableScope::Tournament => String::new(),
        TableScope::Group(number) => format!("\n\ngroup {number}"),
        TableScope::Final => "\n\nfinal".to_owned(),
    };
    format!(
        "{heading}\n{}",
        table::standings_table(&standings.standings)
    )
}

/// How often each team was champion in replays of the schedule.
pub(in crate::commands) fn champion_shares_text(view: &ChampionSharesView) -> String {
    if view.replays == 0 {
        return "the schedule has not been replayed; organisers start replays with faceoff admin tournament replay TOURNAMENT TIMES"
            .to_owned();
    }
    let mut lines = vec![format!(
        "{} replays, {} of them complete ({} of {} games){}",
        view.replays,
        view.complete,
        view.games_played,
        view.games,
        match view.given_up {
            0 => String::new(),
            count => format!("; {count} cancelled or failed"),
        }
    )];
    for share in &view.champions {
        let [low, high] = share.share_ci95;
        lines.push(format!(
            "{:<40} champion {:>4} times: {:>5.1} % (95 %: {:.1} to {:.1})",
            share.team,
            share.first_places,
            100.0 * share.share,
            100.0 * low,
            100.0 * high
        ));
    }
    lines.join("\n")
}
