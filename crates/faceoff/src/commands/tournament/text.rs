//! Tournaments in words.

use crate::commands::{output::or_none, score::table};
use faceoff_api::views::{
    certainty::CertaintyView,
    tournament::{EntrantView, RoundView, TournamentHead, TournamentPhase, TournamentView},
};
use faceoff_scoring::tournament::schedule::{Table, TableOf};
use faceoff_types::{LeftAs, Publishes, RoundNumber, TournamentFormat, TournamentRules};
use jiff::Timestamp;

pub(in crate::commands) fn list(tournaments: &[TournamentHead]) -> String {
    let line =
        |one: &TournamentHead| format!("{}  {}  {}: {}", one.id, one.name, phase(one), one.next);
    or_none(
        tournaments.iter().map(line).collect(),
        "no tournament yet; an organiser opens one: faceoff admin tournament open NAME",
    )
}

fn phase(head: &TournamentHead) -> String {
    let phase = match head.phase {
        TournamentPhase::Open => "open",
        TournamentPhase::Round => "a round is under way",
        TournamentPhase::Between => "between rounds",
        TournamentPhase::Played => "all rounds are over",
        TournamentPhase::Closed => "closed",
    };
    let paused = match (&head.paused, head.phase) {
        (Some(_), phase) if phase != TournamentPhase::Closed => ", paused",
        _ => "",
    };
    let champion = match &head.champion {
        Some(team) => format!(", champion {team}"),
        None => String::new(),
    };
    format!("{phase}{paused}{champion}")
}

fn time(at: Timestamp) -> String {
    at.strftime("%Y-%m-%d %H:%M UTC").to_string()
}

/// All that is to be said of one.
pub(in crate::commands) fn whole(tournament: &TournamentView) -> String {
    let head = &tournament.head;
    let settings = &tournament.settings;
    let mut lines = vec![
        format!("{} ({})", head.name, phase(head)),
        format!("  id        {}", head.id),
        format!("  rules     {}", rules(&tournament.rules)),
        format!(
            "  beside    {} games a day that do not count for each team, recordings {}",
            settings.free_games_per_day,
            match settings.publishes {
                Publishes::Never => "not public",
                Publishes::AtClose => "public when the tournament is closed",
                Publishes::AtRelease => "public when their round is over",
            }
        ),
        match tournament.baseline {
            Some(submission) => format!("  baseline  submission {submission}"),
            None => "  baseline  none, so there are no test games".to_owned(),
        },
    ];
    lines.extend(
        head.paused
            .as_ref()
            .map(|paused| format!("  paused    since {}: {}", time(paused.at), paused.reason)),
    );
    if tournament.entrants.is_empty() {
        lines.push("  teams     none: `faceoff admin tournament enter` takes them in".to_owned());
    }
    for (number, entrant) in tournament.entrants.iter().enumerate() {
        let title = if number == 0 { "teams" } else { "" };
        lines.push(format!("  {title:<8}  {}", self::entrant(entrant)));
    }
    lines.extend(tournament.rounds.iter().map(round));
    lines.push(format!("  next      {}", head.next));
    let tables = tournament.tables.iter();
    let tables: String = tables
        .filter(|table| !table.standings.is_empty())
        .map(self::table)
        .collect();
    lines.join("\n") + tables.trim_end()
}

fn rules(rules: &TournamentRules) -> String {
    let format = match &rules.format {
        TournamentFormat::RoundRobin { rounds } => {
            format!("{}, in each everybody meets everybody", counted(*rounds))
        }
        TournamentFormat::Groups { groups, advance } => {
            format!("{groups} groups, {advance} of each to the final round")
        }
        TournamentFormat::Swiss { rounds } => format!("{}, by the Swiss system", counted(*rounds)),
    };
    let mirrored = if rules.mirrored {
        ", mirrored pairs"
    } else {
        ""
    };
    format!(
        "{format}{mirrored}; {} control steps a game, {} ({})",
        rules.steps, rules.profile, rules.ruleset
    )
}

fn counted(rounds: RoundNumber) -> String {
    match rounds.get() {
        1 => "one round".to_owned(),
        many => format!("{many} rounds"),
    }
}

fn entrant(entrant: &EntrantView) -> String {
    match &entrant.left {
        None => entrant.team_name.to_string(),
        Some(left) => {
            let how = match left.r#as {
                LeftAs::Withdrawn => "withdrawn",
                LeftAs::Disqualified => "disqualified",
            };
            format!(
                "{} ({how}, from round {} on: {})",
                entrant.team_name, left.from_round, left.reason
            )
        }
    }
}

/// A round in a line, or in a few.
pub(in crate::commands) fn round(round: &RoundView) -> String {
    let progress = &round.progress;
    let mut parts = vec![format!(
        "{} of {} games played",
        progress.played, progress.games
    )];
    for (count, words) in [
        (progress.running, "running"),
        (progress.queued, "queued"),
        (progress.to_be_rerun, "void or broken, to be played again"),
        (progress.cancelled, "not played"),
    ] {
        if count > 0 {
            parts.push(format!("{count} {words}"));
        }
    }
    let over = match round.over_at {
        Some(at) => format!(", over {}", time(at)),
        None => String::new(),
    };
    let mut text = format!(
        "  round {:<3} started {}{over}: {}",
        round.number.get(),
        time(round.started_at),
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
            "\n            matchday {}: {} has nobody to play",
            bye.matchday, bye.team_name
        ));
    }
    text
}

fn table(standings: &Table) -> String {
    let of = match standings.of {
        TableOf::Tournament => String::new(),
        TableOf::Group(number) => format!("\n\ngroup {number}"),
        TableOf::Final => "\n\nfinal".to_owned(),
    };
    format!("{of}\n{}", table::of_standings(&standings.standings))
}

/// How sure the champion is.
pub(in crate::commands) fn certainty(told: &CertaintyView) -> String {
    if told.replays == 0 {
        return "the schedule was not played again; an organiser has it: faceoff admin tournament replay TOURNAMENT TIMES"
            .to_owned();
    }
    let mut lines = vec![format!(
        "played again {} times, {} of them to the end ({} of {} games){}",
        told.replays,
        told.complete,
        told.games_played,
        told.games,
        match told.given_up {
            0 => String::new(),
            many => format!("; {many} were called off or broken"),
        }
    )];
    for share in &told.champions {
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
