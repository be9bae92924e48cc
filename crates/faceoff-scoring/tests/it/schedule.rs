//! Tests of schedules: properties for any number of teams, any seed and any results, and errors.

use crate::{
    most_pairs::most_pairs,
    support::{read, team},
};
use faceoff_scoring::tournament::{
    Departure, DepartureKind, Departures, POINTS_BYE, PlayedGame, RoundNumber,
    schedule::{Entrants, Format, Progress, Round, Schedule, ScheduleError, TableScope},
    score_tournament_with,
};
use faceoff_types::{Seed, TeamName};
use proptest::prelude::*;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};

fn names(count: usize) -> Vec<TeamName> {
    (0..count).map(|n| team(&format!("T{n:02}"))).collect()
}

fn round_number(number: u32) -> RoundNumber {
    number.try_into().unwrap()
}

fn round_robin(rounds: u32) -> Format {
    Format::RoundRobin {
        rounds: round_number(rounds),
    }
}

/// A simulated tournament.
struct SimulatedTournament {
    format: Format,
    seed: Seed,
    entrants: Entrants,
    departures: Departures,
    rounds: Vec<Round>,
    games: Vec<PlayedGame>,
}

impl SimulatedTournament {
    fn new(format: Format, teams: Vec<TeamName>, seed: u64) -> Self {
        Self {
            format,
            seed: Seed::from_number(seed),
            entrants: Entrants::new(teams).unwrap(),
            departures: Departures::default(),
            rounds: Vec::new(),
            games: Vec::new(),
        }
    }

    fn progress(&self) -> Progress<'_> {
        Progress {
            entrants: &self.entrants,
            departures: &self.departures,
            rounds: &self.rounds,
            games: &self.games,
        }
    }

    /// Draws and adds the next round; `None` after the last.
    fn draw(&mut self) -> Result<Option<&Round>, ScheduleError> {
        let next = self.format.next_round(&self.seed, &self.progress())?;
        Ok(next.map(|round| {
            self.rounds.push(round);
            self.rounds.last().unwrap()
        }))
    }

    /// Adds results to all games of the last round, with the goals from `goals`.
    fn play(&mut self, mut goals: impl FnMut(&TeamName, &TeamName) -> [u32; 2]) {
        let round = self.rounds.last().unwrap();
        for pairing in round.pairings() {
            let entry = json!({
                "round": round.number, "home": pairing.home, "away": pairing.away, "fouls": [0, 0],
                "goals": goals(&pairing.home, &pairing.away), "penalty_points": [0, 0],
            });
            self.games.push(read(&entry.to_string()).unwrap());
        }
    }
}

/// Number of games of each two teams, sorted by name.
fn game_counts<'a>(
    rounds: impl IntoIterator<Item = &'a Round>,
) -> BTreeMap<[&'a TeamName; 2], usize> {
    let mut counts = BTreeMap::new();
    for pairing in rounds.into_iter().flat_map(Round::pairings) {
        let mut teams = pairing.teams();
        teams.sort();
        *counts.entry(teams).or_default() += 1;
    }
    counts
}

/// Home games minus away games of a team.
fn home_balance(rounds: &[Round], team: &TeamName) -> i64 {
    rounds
        .iter()
        .flat_map(Round::pairings)
        .map(|pairing| i64::from(pairing.home == *team) - i64::from(pairing.away == *team))
        .sum()
}

#[track_caller]
fn assert_one_game_per_team_and_day(round: &Round) {
    for day in &round.matchdays {
        let playing = day.pairings.iter().flat_map(|pairing| pairing.teams());
        let teams: Vec<_> = playing.chain(&day.byes).collect();
        let different: BTreeSet<_> = teams.iter().collect();
        assert_eq!(different.len(), teams.len(), "{day:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn round_robin_pairs_all_teams_once_per_round(
        count in 2usize..24,
        rounds in 1u32..5,
        seed in any::<u64>(),
    ) {
        let format = round_robin(rounds);
        let mut tournament = SimulatedTournament::new(format, names(count), seed);
        while let Some(round) = tournament.draw().unwrap() {
            assert_one_game_per_team_and_day(round);
            let counts = game_counts([round]);
            prop_assert_eq!(counts.len(), count * (count - 1) / 2);
            prop_assert!(counts.values().all(|times| *times == 1));
            let byes: BTreeSet<_> = round.byes().collect();
            let (days, expected) = if count % 2 == 0 { (count - 1, 0) } else { (count, count) };
            prop_assert_eq!((round.byes().count(), byes.len()), (expected, expected));
            prop_assert_eq!(round.matchdays.len(), days, "the minimum number of days");
            tournament.play(|_, _| [1, 0]);
            // Home and away games differ by at most one, and are equal after each second round.
            let round_count = tournament.rounds.len();
            for team in tournament.entrants.iter() {
                let max = i64::from(round_count % 2 == 1 && count % 2 == 0);
                prop_assert!(home_balance(&tournament.rounds, team).abs() <= max);
            }
        }
        prop_assert_eq!(tournament.rounds.len(), rounds as usize);
    }

    #[test]
    fn schedule_does_not_depend_on_order_of_entrants(
        teams in Just(names(9)).prop_shuffle(),
        seed in any::<u64>(),
    ) {
        for format in [
            round_robin(2),
            Format::Groups { groups: 2, advance: 2 },
            Format::Swiss { rounds: round_number(4) },
        ] {
            let [entered, sorted, other] = [
                (teams.clone(), seed),
                (names(9), seed),
                (names(9), seed.wrapping_add(1)),
            ].map(|(teams, seed)| {
                let mut tournament = SimulatedTournament::new(format, teams, seed);
                while tournament.draw().unwrap().is_some() {
                    tournament.play(|home, away| if home < away { [2, 1] } else { [0, 3] });
                }
                tournament.rounds
            });
            prop_assert_eq!(&entered, &sorted);
            prop_assert_ne!(&entered, &other, "another seed gives another draw of nine teams");
        }
    }

    #[test]
    fn swiss_avoids_repeats_and_distributes_byes(
        count in 2usize..10,
        rounds in 1u32..12,
        seed in any::<u64>(),
        goals in proptest::collection::vec([0u32..4, 0u32..4], 100),
    ) {
        let format = Format::Swiss { rounds: round_number(rounds) };
        let mut tournament = SimulatedTournament::new(format, names(count), seed);
        let mut goals = goals.into_iter().cycle();
        while tournament.draw().unwrap().is_some() {
            let (round, earlier) = tournament.rounds.split_last().unwrap();
            assert_one_game_per_team_and_day(round);
            prop_assert_eq!(round.pairings().count(), count / 2);
            prop_assert_eq!(round.byes().count(), count % 2);

            // Repeats: the minimum over all pairings of these teams.
            let counts = game_counts(earlier);
            let have_not_met = |a: &TeamName, b: &TeamName| {
                !counts.contains_key(&[a.min(b), a.max(b)])
            };
            let playing: Vec<_> = round.pairings().flat_map(|pairing| pairing.teams()).collect();
            let new_pairs = round
                .pairings()
                .filter(|pairing| have_not_met(&pairing.home, &pairing.away))
                .count();
            prop_assert_eq!(new_pairs, most_pairs(&playing, &have_not_met));
            if earlier.len() < count / 2 {
                prop_assert_eq!(new_pairs, count / 2, "in early rounds there is always a pairing without repeats");
            }

            // The home team has at most as many home games.
            for pairing in round.pairings() {
                let [home, away] = pairing.teams().map(|team| home_balance(earlier, team));
                prop_assert!(home <= away);
            }

            // Byes: no team has a second one before all had one; the lowest of the teams with the fewest gets it.
            let bye_count = |team: &TeamName| {
                earlier.iter().flat_map(Round::byes).filter(|other| *other == team).count()
            };
            if let Some(bye) = round.byes().next() {
                let fewest = tournament.entrants.iter().map(bye_count).min().unwrap();
                prop_assert_eq!(bye_count(bye), fewest);
                if !earlier.is_empty() {
                    let byes = tournament.format.byes(earlier);
                    let table = score_tournament_with(&tournament.games, &Departures::default(), &byes);
                    let lowest = table.standings.iter().rfind(|row| bye_count(&row.team) == fewest);
                    prop_assert_eq!(&lowest.unwrap().team, bye);
                }
            }
            tournament.play(|_, _| goals.next().unwrap());
        }
        prop_assert_eq!(tournament.rounds.len(), rounds as usize);
    }

    #[test]
    fn groups_are_balanced_and_winners_reach_final(
        count in 4usize..20,
        groups in 1u32..5,
        seed in any::<u64>(),
    ) {
        prop_assume!(count / groups as usize >= 2);
        let advance = if groups == 1 { 2 } else { 1 };
        let mut tournament = SimulatedTournament::new(Format::Groups { groups, advance }, names(count), seed);
        let first = tournament.draw().unwrap().unwrap().clone();
        assert_one_game_per_team_and_day(&first);
        let sizes: Vec<_> = first.groups.iter().map(Vec::len).collect();
        prop_assert_eq!(sizes.len(), groups as usize);
        prop_assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1);
        let expected: usize = sizes.iter().map(|size| size * (size - 1) / 2).sum();
        prop_assert_eq!(game_counts([&first]).len(), expected);
        for pairing in first.pairings() {
            let contains_both = |group: &&Vec<TeamName>| {
                pairing.teams().into_iter().all(|team| group.contains(team))
            };
            prop_assert_eq!(first.groups.iter().filter(contains_both).count(), 1);
        }
        // The team with the earlier name wins, so that the first of each group is known.
        tournament.play(|home, away| if home < away { [1, 0] } else { [0, 1] });
        let last = tournament.draw().unwrap().unwrap().clone();
        let mut expected: Vec<TeamName> = first
            .groups
            .iter()
            .flat_map(|group| {
                let mut group = group.clone();
                group.sort();
                group.truncate(advance as usize);
                group
            })
            .collect();
        expected.sort();
        let finalists: BTreeSet<_> = last.pairings().flat_map(|pairing| pairing.teams()).collect();
        prop_assert!(finalists.into_iter().eq(&expected));
        prop_assert_eq!(game_counts([&last]).len(), expected.len() * (expected.len() - 1) / 2);
        tournament.play(|home, away| if home < away { [1, 0] } else { [0, 1] });
        prop_assert_eq!(tournament.draw().unwrap(), None);
        let tables = tournament.format.tables(&tournament.progress());
        prop_assert_eq!(tables.len(), 1 + groups as usize);
        prop_assert_eq!(tables[0].scope, TableScope::Final);
        prop_assert_eq!(&tables[0].standings[0].team, &expected[0]);
        prop_assert_eq!(tables[1].scope, TableScope::Group(1));
        prop_assert_eq!(tables[1].standings.len(), first.groups[0].len());
    }
}

#[test]
fn final_of_two_groups_with_one_finalist_is_one_game() {
    let mut tournament = SimulatedTournament::new(
        Format::Groups {
            groups: 2,
            advance: 1,
        },
        names(6),
        1,
    );
    tournament.draw().unwrap();
    tournament.play(|_, _| [1, 0]);
    assert_eq!(tournament.draw().unwrap().unwrap().pairings().count(), 1);
}

/// As in the paper's tournament: six teams, and a seventh from the second round.
#[test]
fn team_may_enter_between_two_rounds() {
    let format = round_robin(2);
    let mut tournament = SimulatedTournament::new(format, names(6), 3);
    tournament.draw().unwrap();
    tournament.play(|_, _| [1, 0]);
    tournament.entrants = Entrants::new(names(7)).unwrap();
    tournament.draw().unwrap();
    assert_eq!(
        tournament
            .rounds
            .iter()
            .map(|round| round.pairings().count())
            .collect::<Vec<_>>(),
        [15, 21]
    );
    for [a, b] in game_counts(&tournament.rounds[..1]).into_keys() {
        let home = |round: &Round| {
            round
                .pairings()
                .find(|pairing| pairing.is_between([a, b]))
                .unwrap()
                .home
                .clone()
        };
        assert_ne!(
            home(&tournament.rounds[0]),
            home(&tournament.rounds[1]),
            "sides are swapped"
        );
    }
}

#[test]
fn departure_excludes_team_and_its_open_games() {
    let format = round_robin(3);
    let mut tournament = SimulatedTournament::new(format, names(4), 5);
    tournament.draw().unwrap();
    assert_eq!(tournament.progress().current_round(), Some(round_number(1)));
    tournament.play(|_, _| [1, 0]);
    assert_eq!(
        tournament.progress().current_round(),
        Some(round_number(2)),
        "between two rounds"
    );
    tournament.draw().unwrap();
    tournament.play(|_, _| [1, 0]);
    // In the second round, the games of T00 and one other game are still open.
    let involves = |game: &PlayedGame, name: &str| game.teams().contains(&&team(name));
    let between = |game: &PlayedGame| involves(game, "T01") && involves(game, "T02");
    let (open, finished) = std::mem::take(&mut tournament.games)
        .into_iter()
        .partition::<Vec<_>, _>(|game| {
            game.round() == 2 && (involves(game, "T00") || between(game))
        });
    tournament.games = finished;
    assert_eq!(open.len(), 4);
    let from_round = tournament.progress().current_round().unwrap();
    assert_eq!(from_round, round_number(2));
    tournament.departures = Departures::new([Departure {
        team: team("T00"),
        kind: DepartureKind::Withdrawn,
        from_round,
    }])
    .unwrap();
    let error = tournament.draw().unwrap_err().to_string();
    assert!(
        error.starts_with("round 2 is under way: 1 of its games have no result, ")
            && error.contains("T01")
            && error.contains("T02"),
        "{error}"
    );
    tournament.games.extend(open.into_iter().filter(between));
    let third = tournament.draw().unwrap().unwrap();
    assert_eq!(third.number, round_number(3));
    assert_eq!(game_counts([third]).len(), 3);
    assert!(
        third
            .pairings()
            .all(|pairing| !pairing.teams().contains(&&team("T00")))
    );
}

#[test]
fn swiss_bye_gives_points_of_a_win() {
    let rounds = round_number(2);
    let mut tournament = SimulatedTournament::new(Format::Swiss { rounds }, names(3), 8);
    tournament.draw().unwrap();
    tournament.play(|_, _| [0, 0]);
    let bye = tournament.rounds[0].byes().next().unwrap().clone();
    let tables = tournament.format.tables(&tournament.progress());
    assert_eq!(tables[0].scope, TableScope::Tournament);
    let first = &tables[0].standings[0];
    assert_eq!(
        (&first.team, first.points, first.byes),
        (&bye, POINTS_BYE, 1)
    );
    assert_eq!(round_robin(1).byes(&tournament.rounds), []);
}

#[test]
fn impossible_schedule_is_refused_with_reason() {
    let entrants = |teams: &[&str]| Entrants::new(teams.iter().map(|name| team(name)));
    let message = |result: Result<Entrants, ScheduleError>| result.unwrap_err().to_string();
    assert_eq!(
        message(entrants(&["A"])),
        "a tournament needs at least two teams, there are 1; enter more"
    );
    assert_eq!(
        message(entrants(&["A", "B", "A"])),
        "A is entered twice; enter each team once"
    );
    assert_eq!(
        message(Entrants::new(names(257))),
        "a tournament has at most 256 teams, there are 257; split them into several tournaments"
    );

    let format = round_robin(2);
    let refused = |change: &dyn Fn(&mut SimulatedTournament)| {
        let mut tournament = SimulatedTournament::new(format, names(3), 1);
        tournament.draw().unwrap();
        tournament.play(|_, _| [1, 0]);
        change(&mut tournament);
        tournament.draw().unwrap_err().to_string()
    };
    let game = |round: u32, home: &str, away: &str| -> PlayedGame {
        let entry = json!({"round": round, "home": home, "away": away, "goals": [0, 0],
                           "fouls": [0, 0], "penalty_points": [0, 0]});
        read(&entry.to_string()).unwrap()
    };
    let departures = |names: &[&str]| {
        Departures::new(names.iter().map(|name| Departure {
            team: team(name),
            kind: DepartureKind::Withdrawn,
            from_round: round_number(1),
        }))
        .unwrap()
    };
    assert_eq!(
        refused(&|tournament| tournament.games.push(game(1, "T00", "Zed"))),
        "Zed is in a game of round 1, but is not entered; enter the team or remove it there"
    );
    assert_eq!(
        refused(&|tournament| tournament.games.push(game(2, "T00", "T01"))),
        "T00 against T01 is no game of round 2; remove its result"
    );
    assert_eq!(
        refused(&|tournament| tournament.departures = departures(&["Zed"])),
        "Zed is in the list of departures, but is not entered; enter the team or remove it there"
    );
    assert_eq!(
        refused(&|tournament| tournament.departures = departures(&["T00", "T02"])),
        "a tournament needs at least two teams, there are 1; enter more"
    );
    assert_eq!(
        refused(&|tournament| tournament.rounds[0].number = round_number(2)),
        "expected round 1, got 2; give all earlier rounds in order"
    );
    assert_eq!(
        refused(&|tournament| tournament.entrants = Entrants::new(names(2)).unwrap()),
        "T02 is in round 1, but is not entered; enter the team or remove it there"
    );
    for (groups, advance, words) in [
        (
            0,
            1,
            "groups: expected 1 to 2, so that each of the 5 teams has an opponent in its group, got 0",
        ),
        (
            3,
            1,
            "groups: expected 1 to 2, so that each of the 5 teams has an opponent in its group, got 3",
        ),
        (
            2,
            3,
            "advance: expected 1 to 2, the size of the smallest group, got 3",
        ),
        (
            1,
            1,
            "advance: expected 2 to 5, the size of the smallest group, got 1",
        ),
    ] {
        let mut tournament =
            SimulatedTournament::new(Format::Groups { groups, advance }, names(5), 1);
        assert_eq!(tournament.draw().unwrap_err().to_string(), words);
    }
}

#[test]
fn format_and_round_round_trip_as_json() {
    let format = Format::Groups {
        groups: 2,
        advance: 1,
    };
    let written = serde_json::to_value(format).unwrap();
    assert_eq!(
        written,
        json!({"kind": "groups", "groups": 2, "advance": 1})
    );
    assert_eq!(serde_json::from_value::<Format>(written).unwrap(), format);
    let mut tournament = SimulatedTournament::new(format, names(5), 1);
    let round = tournament.draw().unwrap().unwrap();
    let written = serde_json::to_string(round).unwrap();
    assert_eq!(&read::<Round>(&written).unwrap(), round);
    assert!(
        read::<Format>(r#"{"kind": "swiss", "rounds": 0}"#)
            .unwrap_err()
            .contains("expected 1 to 100, got 0")
    );
}
