//! What schedules promise, for any number of teams, any seed and any results.

use crate::{
    most_pairs::most_pairs,
    support::{read, team},
};
use faceoff_scoring::tournament::{
    Departure, Departures, LeftAs, POINTS_BYE, PlayedGame, RoundNumber,
    schedule::{Entrants, Format, Progress, Round, Schedule, ScheduleError, TableOf},
    score_tournament_with,
};
use faceoff_types::{Seed, TeamName};
use proptest::prelude::*;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};

fn names(count: usize) -> Vec<TeamName> {
    (0..count).map(|n| team(&format!("T{n:02}"))).collect()
}

fn number(number: u32) -> RoundNumber {
    number.try_into().unwrap()
}

/// A tournament that is played to its end, or as far as wanted.
struct Played {
    format: Format,
    seed: Seed,
    entrants: Entrants,
    departures: Departures,
    rounds: Vec<Round>,
    games: Vec<PlayedGame>,
}

impl Played {
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

    fn draw(&mut self) -> Result<Option<&Round>, ScheduleError> {
        let next = self.format.next_round(&self.seed, &self.progress())?;
        Ok(next.map(|round| {
            self.rounds.push(round);
            self.rounds.last().unwrap()
        }))
    }

    /// Every open game of the last round gets the goals that `goals` says.
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

/// How often each two teams, by name, meet in the rounds.
fn meetings<'a>(rounds: impl IntoIterator<Item = &'a Round>) -> BTreeMap<[&'a TeamName; 2], usize> {
    let mut all = BTreeMap::new();
    for pairing in rounds.into_iter().flat_map(Round::pairings) {
        let mut teams = pairing.teams();
        teams.sort();
        *all.entry(teams).or_default() += 1;
    }
    all
}

fn home_balance(rounds: &[Round], of: &TeamName) -> i64 {
    rounds
        .iter()
        .flat_map(Round::pairings)
        .map(|pairing| i64::from(pairing.home == *of) - i64::from(pairing.away == *of))
        .sum()
}

#[track_caller]
fn nobody_plays_twice_a_day(round: &Round) {
    for day in &round.matchdays {
        let playing = day.pairings.iter().flat_map(|pairing| pairing.teams());
        let all: Vec<_> = playing.chain(&day.byes).collect();
        let different: BTreeSet<_> = all.iter().collect();
        assert_eq!(different.len(), all.len(), "{day:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn in_a_round_robin_everybody_meets_everybody_once_a_round(
        count in 2usize..24,
        rounds in 1u32..5,
        seed in any::<u64>(),
    ) {
        let format = Format::RoundRobin { rounds: number(rounds) };
        let mut played = Played::new(format, names(count), seed);
        while let Some(round) = played.draw().unwrap() {
            nobody_plays_twice_a_day(round);
            let met = meetings([round]);
            prop_assert_eq!(met.len(), count * (count - 1) / 2);
            prop_assert!(met.values().all(|times| *times == 1));
            let byes: BTreeSet<_> = round.byes().collect();
            let (days, expected) = if count % 2 == 0 { (count - 1, 0) } else { (count, count) };
            prop_assert_eq!((round.byes().count(), byes.len()), (expected, expected));
            prop_assert_eq!(round.matchdays.len(), days, "as many as it takes, and no more");
            played.play(|_, _| [1, 0]);
            // Home and away: apart by one at most, and even after each second round.
            let so_far = played.rounds.len();
            for of in played.entrants.iter() {
                let most = i64::from(so_far % 2 == 1 && count % 2 == 0);
                prop_assert!(home_balance(&played.rounds, of).abs() <= most);
            }
        }
        prop_assert_eq!(played.rounds.len(), rounds as usize);
    }

    #[test]
    fn the_same_seed_gives_the_same_schedule_in_whatever_order_teams_enter(
        teams in Just(names(9)).prop_shuffle(),
        seed in any::<u64>(),
    ) {
        for format in [
            Format::RoundRobin { rounds: number(2) },
            Format::Groups { groups: 2, advance: 2 },
            Format::Swiss { rounds: number(4) },
        ] {
            let [entered, sorted, other] = [
                (teams.clone(), seed),
                (names(9), seed),
                (names(9), seed.wrapping_add(1)),
            ].map(|(teams, seed)| {
                let mut played = Played::new(format, teams, seed);
                while played.draw().unwrap().is_some() {
                    played.play(|home, away| if home < away { [2, 1] } else { [0, 3] });
                }
                played.rounds
            });
            prop_assert_eq!(&entered, &sorted);
            prop_assert_ne!(&entered, &other, "nine teams can be drawn in many ways");
        }
    }

    #[test]
    fn swiss_repeats_no_pairing_that_can_be_avoided_and_shares_byes_out(
        count in 2usize..10,
        rounds in 1u32..12,
        seed in any::<u64>(),
        goals in proptest::collection::vec([0u32..4, 0u32..4], 100),
    ) {
        let format = Format::Swiss { rounds: number(rounds) };
        let mut played = Played::new(format, names(count), seed);
        let mut goals = goals.into_iter().cycle();
        while played.draw().unwrap().is_some() {
            let (round, earlier) = played.rounds.split_last().unwrap();
            nobody_plays_twice_a_day(round);
            prop_assert_eq!(round.pairings().count(), count / 2);
            prop_assert_eq!(round.byes().count(), count % 2);

            // Repeats: as few as any pairing of those who play has.
            let met = meetings(earlier);
            let have_not_met = |a: &TeamName, b: &TeamName| {
                !met.contains_key(&[a.min(b), a.max(b)])
            };
            let playing: Vec<_> = round.pairings().flat_map(|pairing| pairing.teams()).collect();
            let new = round
                .pairings()
                .filter(|pairing| have_not_met(&pairing.home, &pairing.away))
                .count();
            prop_assert_eq!(new, most_pairs(&playing, &have_not_met));
            if earlier.len() < count / 2 {
                prop_assert_eq!(new, count / 2, "so early there is always a pairing without repeats");
            }

            // Home is who was so less often.
            for pairing in round.pairings() {
                let [home, away] = pairing.teams().map(|team| home_balance(earlier, team));
                prop_assert!(home <= away);
            }

            // Byes: nobody has two before all had one, and the lowest of those gets it.
            let had = |team: &TeamName| {
                earlier.iter().flat_map(Round::byes).filter(|other| *other == team).count()
            };
            if let Some(bye) = round.byes().next() {
                let fewest = played.entrants.iter().map(had).min().unwrap();
                prop_assert_eq!(had(bye), fewest);
                if !earlier.is_empty() {
                    let byes = played.format.byes(earlier);
                    let table = score_tournament_with(&played.games, &Departures::default(), &byes);
                    let lowest = table.standings.iter().rfind(|row| had(&row.team) == fewest);
                    prop_assert_eq!(&lowest.unwrap().team, bye);
                }
            }
            played.play(|_, _| goals.next().unwrap());
        }
        prop_assert_eq!(played.rounds.len(), rounds as usize);
    }

    #[test]
    fn groups_are_even_and_their_best_reach_the_final(
        count in 4usize..20,
        groups in 1u32..5,
        seed in any::<u64>(),
    ) {
        prop_assume!(count / groups as usize >= 2);
        let advance = if groups == 1 { 2 } else { 1 };
        let mut played = Played::new(Format::Groups { groups, advance }, names(count), seed);
        let first = played.draw().unwrap().unwrap().clone();
        nobody_plays_twice_a_day(&first);
        let sizes: Vec<_> = first.groups.iter().map(Vec::len).collect();
        prop_assert_eq!(sizes.len(), groups as usize);
        prop_assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1);
        let expected: usize = sizes.iter().map(|size| size * (size - 1) / 2).sum();
        prop_assert_eq!(meetings([&first]).len(), expected);
        for pairing in first.pairings() {
            let together = |group: &&Vec<TeamName>| {
                pairing.teams().into_iter().all(|team| group.contains(team))
            };
            prop_assert_eq!(first.groups.iter().filter(together).count(), 1);
        }
        // The earlier name wins, so that the first of each group is known.
        played.play(|home, away| if home < away { [1, 0] } else { [0, 1] });
        let last = played.draw().unwrap().unwrap().clone();
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
        prop_assert_eq!(meetings([&last]).len(), expected.len() * (expected.len() - 1) / 2);
        played.play(|home, away| if home < away { [1, 0] } else { [0, 1] });
        prop_assert_eq!(played.draw().unwrap(), None);
        let tables = played.format.tables(&played.progress());
        prop_assert_eq!(tables.len(), 1 + groups as usize);
        prop_assert_eq!(tables[0].of, TableOf::Final);
        prop_assert_eq!(&tables[0].standings[0].team, &expected[0]);
        prop_assert_eq!(tables[1].of, TableOf::Group(1));
        prop_assert_eq!(tables[1].standings.len(), first.groups[0].len());
    }
}

#[test]
fn two_groups_and_one_to_advance_make_a_final_of_one_game() {
    let mut played = Played::new(
        Format::Groups {
            groups: 2,
            advance: 1,
        },
        names(6),
        1,
    );
    played.draw().unwrap();
    played.play(|_, _| [1, 0]);
    assert_eq!(played.draw().unwrap().unwrap().pairings().count(), 1);
}

/// The paper's tournament: six teams, then a seventh in the second round.
#[test]
fn a_team_may_enter_between_two_rounds() {
    let format = Format::RoundRobin { rounds: number(2) };
    let mut played = Played::new(format, names(6), 3);
    played.draw().unwrap();
    played.play(|_, _| [1, 0]);
    played.entrants = Entrants::new(names(7)).unwrap();
    played.draw().unwrap();
    assert_eq!(
        played
            .rounds
            .iter()
            .map(|round| round.pairings().count())
            .collect::<Vec<_>>(),
        [15, 21]
    );
    for [a, b] in meetings(&played.rounds[..1]).into_keys() {
        let home = |round: &Round| {
            round
                .pairings()
                .find(|p| p.is_between([a, b]))
                .unwrap()
                .home
                .clone()
        };
        assert_ne!(
            home(&played.rounds[0]),
            home(&played.rounds[1]),
            "sides are swapped"
        );
    }
}

#[test]
fn who_left_is_paired_no_more_and_its_open_games_hold_nothing_up() {
    let format = Format::RoundRobin { rounds: number(3) };
    let mut played = Played::new(format, names(4), 5);
    played.draw().unwrap();
    assert_eq!(played.progress().round_under_way(), Some(number(1)));
    played.play(|_, _| [1, 0]);
    assert_eq!(
        played.progress().round_under_way(),
        Some(number(2)),
        "between two rounds"
    );
    played.draw().unwrap();
    played.play(|_, _| [1, 0]);
    // Of the second round, the games of T00 and one other are still open.
    let involves = |game: &PlayedGame, name: &str| game.teams().contains(&&team(name));
    let between = |game: &PlayedGame| involves(game, "T01") && involves(game, "T02");
    let (open, done) = std::mem::take(&mut played.games)
        .into_iter()
        .partition::<Vec<_>, _>(|game| {
            game.round() == 2 && (involves(game, "T00") || between(game))
        });
    played.games = done;
    assert_eq!(open.len(), 4);
    let from_round = played.progress().round_under_way().unwrap();
    assert_eq!(from_round, number(2));
    played.departures = Departures::new([Departure {
        team: team("T00"),
        left_as: LeftAs::Withdrawn,
        from_round,
    }])
    .unwrap();
    let error = played.draw().unwrap_err().to_string();
    assert!(
        error.starts_with("round 2 is under way: 1 of its games have no result, ")
            && error.contains("T01")
            && error.contains("T02"),
        "{error}"
    );
    played.games.extend(open.into_iter().filter(between));
    let third = played.draw().unwrap().unwrap();
    assert_eq!(third.number, number(3));
    assert_eq!(meetings([third]).len(), 3);
    assert!(
        third
            .pairings()
            .all(|pairing| !pairing.teams().contains(&&team("T00")))
    );
}

#[test]
fn a_swiss_bye_gives_the_points_of_a_win() {
    let mut played = Played::new(Format::Swiss { rounds: number(2) }, names(3), 8);
    played.draw().unwrap();
    played.play(|_, _| [0, 0]);
    let bye = played.rounds[0].byes().next().unwrap().clone();
    let tables = played.format.tables(&played.progress());
    assert_eq!(tables[0].of, TableOf::Tournament);
    let first = &tables[0].standings[0];
    assert_eq!(
        (&first.team, first.points, first.byes),
        (&bye, POINTS_BYE, 1)
    );
    let round_robin = Format::RoundRobin { rounds: number(1) };
    assert_eq!(round_robin.byes(&played.rounds), []);
}

#[test]
fn what_cannot_be_scheduled_is_refused_in_words() {
    let entered = |teams: &[&str]| Entrants::new(teams.iter().map(|name| team(name)));
    let words = |result: Result<Entrants, ScheduleError>| result.unwrap_err().to_string();
    assert_eq!(
        words(entered(&["A"])),
        "a tournament needs at least two teams, there are 1; enter more"
    );
    assert_eq!(
        words(entered(&["A", "B", "A"])),
        "A is entered twice; enter each team once"
    );
    assert_eq!(
        words(Entrants::new(names(257))),
        "a tournament has at most 256 teams, there are 257; divide them"
    );

    let round_robin = Format::RoundRobin { rounds: number(2) };
    let refused = |change: &dyn Fn(&mut Played)| {
        let mut played = Played::new(round_robin, names(3), 1);
        played.draw().unwrap();
        played.play(|_, _| [1, 0]);
        change(&mut played);
        played.draw().unwrap_err().to_string()
    };
    let game = |round: u32, home: &str, away: &str| -> PlayedGame {
        let entry = json!({"round": round, "home": home, "away": away, "goals": [0, 0],
                           "fouls": [0, 0], "penalty_points": [0, 0]});
        read(&entry.to_string()).unwrap()
    };
    let leave = |names: &[&str]| {
        Departures::new(names.iter().map(|name| Departure {
            team: team(name),
            left_as: LeftAs::Withdrawn,
            from_round: number(1),
        }))
        .unwrap()
    };
    assert_eq!(
        refused(&|played| played.games.push(game(1, "T00", "Zed"))),
        "Zed is in a game of round 1, but was never entered; enter it or take it out there"
    );
    assert_eq!(
        refused(&|played| played.games.push(game(2, "T00", "T01"))),
        "T00 against T01 is no game of round 2; take its result out"
    );
    assert_eq!(
        refused(&|played| played.departures = leave(&["Zed"])),
        "Zed is said to have left, but was never entered; enter it or take it out there"
    );
    assert_eq!(
        refused(&|played| played.departures = leave(&["T00", "T02"])),
        "a tournament needs at least two teams, there are 1; enter more"
    );
    assert_eq!(
        refused(&|played| played.rounds[0].number = number(2)),
        "expected round 1, got 2; give all earlier rounds in order"
    );
    assert_eq!(
        refused(&|played| played.entrants = Entrants::new(names(2)).unwrap()),
        "T02 is in round 1, but was never entered; enter it or take it out there"
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
        let mut played = Played::new(Format::Groups { groups, advance }, names(5), 1);
        assert_eq!(played.draw().unwrap_err().to_string(), words);
    }
}

#[test]
fn a_format_and_a_round_are_kept_as_json() {
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
    let mut played = Played::new(format, names(5), 1);
    let round = played.draw().unwrap().unwrap();
    let written = serde_json::to_string(round).unwrap();
    assert_eq!(&read::<Round>(&written).unwrap(), round);
    assert!(
        read::<Format>(r#"{"kind": "swiss", "rounds": 0}"#)
            .unwrap_err()
            .contains("expected 1 to 100, got 0")
    );
}
