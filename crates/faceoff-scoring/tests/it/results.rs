//! Forfeits, departures, byes and records of two teams: made situations.

use crate::support::{read, team};
use faceoff_scoring::tournament::{
    Bye, Departure, Departures, LeftAs, PlayedGame, RoundNumber, Tournament, head_to_head,
    score_tournament, score_tournament_with,
};
use serde_json::{Value, json};

fn games(games: Value) -> Vec<PlayedGame> {
    read(&games.to_string()).unwrap()
}

fn game(round: u32, home: &str, away: &str, goals: [u32; 2]) -> Value {
    json!({"round": round, "home": home, "away": away, "goals": goals, "fouls": [0, 0],
           "penalty_points": [10, 20]})
}

fn with(mut game: Value, field: &str, value: Value) -> Value {
    game[field] = value;
    game
}

/// `[team, points, goals for, goals against]` in order.
fn table(tournament: &Tournament) -> Value {
    tournament
        .standings
        .iter()
        .map(|row| json!([row.team, row.points, row.goals_for, row.goals_against]))
        .collect()
}

fn round(number: u32) -> RoundNumber {
    number.try_into().unwrap()
}

fn leaves(name: &str, left_as: LeftAs, from: u32) -> Departure {
    Departure {
        team: team(name),
        left_as,
        from_round: round(from),
    }
}

#[test]
fn a_forfeited_game_counts_10_to_0_whatever_the_points_and_the_tiers() {
    let unsafe_home = with(game(1, "A", "B", [1, 7]), "penalty_points", json!([900, 0]));
    let played = games(json!([
        with(unsafe_home, "forfeit", json!([null, "faults"])),
        with(
            game(1, "C", "D", [3, 0]),
            "forfeit",
            json!(["time", "faults"])
        ),
    ]));
    let tournament = score_tournament(&played);
    let written = serde_json::to_value(&tournament.games[0]).unwrap();
    assert_eq!(
        written,
        json!({
            "round": 1, "home": "A", "away": "B", "goals": [1, 7], "fouls": [0, 0],
            "penalty_points": [900.0, 0.0], "forfeit": [null, "faults"], "score": [10, 0],
            "winner": "A", "won_by": "forfeit", "winner_led": false,
        })
    );
    let drawn = serde_json::to_value(&tournament.games[1]).unwrap();
    assert_eq!(
        (&drawn["score"], &drawn["winner"], &drawn["drawn_by"]),
        (&json!([0, 0]), &Value::Null, &json!("both_forfeit"))
    );
    assert_eq!(
        table(&tournament),
        json!([
            ["A", 3, 10, 0],
            ["C", 1, 0, 0],
            ["D", 1, 0, 0],
            ["B", 0, 0, 10]
        ])
    );
}

#[test]
fn a_forfeit_that_contradicts_the_score_is_refused() {
    let forfeited = with(game(1, "A", "B", [1, 7]), "forfeit", json!([null, "time"]));
    for (changed, words) in [
        (
            with(forfeited.clone(), "score", json!([1, 7])),
            "counts [10, 0], got [1, 7]",
        ),
        (
            with(forfeited.clone(), "forfeit", json!([null, "sleep"])),
            "unknown variant `sleep`, expected `faults` or `time`",
        ),
        (
            with(
                with(forfeited.clone(), "fouls", Value::Null),
                "score",
                json!([10, 0]),
            ),
            "a forfeited game needs its fouls",
        ),
    ] {
        let error = read::<Vec<PlayedGame>>(&json!([changed]).to_string()).unwrap_err();
        assert!(error.contains(words), "{words:?} is not in: {error}");
    }
    games(json!([with(forfeited, "score", json!([10, 0]))]));
}

#[test]
fn a_team_that_leaves_keeps_its_finished_rounds_and_takes_the_unfinished_one_out_for_everyone() {
    let played = games(json!([
        game(1, "A", "B", [0, 1]),
        game(1, "B", "C", [2, 0]),
        game(1, "C", "A", [0, 3]),
        // B leaves here: A has met it already, C has not.
        game(2, "B", "A", [0, 9]),
        game(2, "A", "C", [1, 0]),
    ]));
    let departures = Departures::new([leaves("B", LeftAs::Withdrawn, 2)]).unwrap();
    let tournament = score_tournament_with(&played, &departures, &[]);
    assert_eq!(
        table(&tournament),
        json!([["A", 6, 4, 1], ["B", 6, 3, 0], ["C", 0, 0, 6]]),
        "A has three for the first round's win over C and three for the second's, none for the 9 : 0"
    );
    let taken_out: Vec<_> = tournament
        .games
        .iter()
        .map(|game| game.taken_out_by.clone())
        .collect();
    assert_eq!(taken_out, [None, None, None, Some(team("B")), None]);
    let row = serde_json::to_value(&tournament.standings[1]).unwrap();
    assert_eq!(row["left"], "withdrawn");
    assert_eq!(row["points_per_round"], json!([6, 0]));
    assert_eq!(departures.counting(&played).count(), 4);
}

#[test]
fn a_disqualified_team_stands_last_and_may_lose_all_its_games() {
    let played = games(json!([
        game(1, "A", "B", [0, 1]),
        game(1, "B", "C", [2, 0]),
        game(1, "C", "A", [0, 3]),
    ]));
    let of = |from| {
        let departures = Departures::new([leaves("B", LeftAs::Disqualified, from)]).unwrap();
        table(&score_tournament_with(&played, &departures, &[]))
    };
    assert_eq!(
        of(2),
        json!([["A", 3, 3, 1], ["C", 0, 0, 5], ["B", 6, 3, 0]])
    );
    assert_eq!(
        of(1),
        json!([["A", 3, 3, 0], ["C", 0, 0, 3], ["B", 0, 0, 0]])
    );
}

#[test]
fn a_team_leaves_once_and_in_a_round_that_can_be() {
    let twice = [
        leaves("A", LeftAs::Withdrawn, 1),
        leaves("A", LeftAs::Disqualified, 2),
    ];
    let error = Departures::new(twice).unwrap_err().to_string();
    assert_eq!(error, "A is said to leave twice; keep the one that counts");
    for number in [0, 101] {
        let error = RoundNumber::try_from(number).unwrap_err().to_string();
        assert_eq!(error, format!("expected 1 to 100, got {number}"));
    }
}

#[test]
fn a_bye_that_gives_points_is_no_game() {
    let played = games(json!([game(1, "A", "B", [1, 0])]));
    let byes = [2, 3].map(|number| Bye {
        round: round(number),
        team: team("C"),
    });
    let tournament = score_tournament_with(&played, &Departures::default(), &byes);
    let first = serde_json::to_value(&tournament.standings[0]).unwrap();
    assert_eq!(
        first,
        json!({"rank": 1, "team": "C", "points": 6, "points_per_round": [0, 3, 3], "wins": 0,
               "draws": 0, "losses": 0, "goals_for": 0, "goals_against": 0, "penalty_points": 0.0,
               "byes": 2})
    );
    // A bye of a round that its team did not finish counts no more than its games would.
    let leaves = Departures::new([Departure {
        team: team("C"),
        left_as: LeftAs::Withdrawn,
        from_round: round(3),
    }]);
    let tournament = score_tournament_with(&played, &leaves.unwrap(), &byes);
    let of_c = tournament
        .standings
        .iter()
        .find(|row| row.team == team("C"));
    assert_eq!(of_c.map(|row| (row.points, row.byes)), Some((3, 1)));
}

#[test]
fn the_record_of_two_teams_holds_both_sides_of_the_table() {
    let forfeited = with(game(2, "A", "B", [0, 4]), "forfeit", json!([null, "time"]));
    let played = games(json!([
        game(1, "B", "A", [5, 2]),
        forfeited,
        game(1, "C", "A", [1, 1]),
    ]));
    let records = head_to_head(&played);
    assert_eq!(
        serde_json::to_value(&records).unwrap(),
        json!([
            {"teams": ["A", "B"], "wins": [1, 1], "draws": 0, "goals": [12, 5]},
            {"teams": ["A", "C"], "wins": [0, 0], "draws": 1, "goals": [1, 1]},
        ])
    );
    assert_eq!(records[0].games(), 2);
}

#[test]
fn the_halves_of_a_mirrored_pair_are_one_meeting() {
    let half = |home, away| with(game(1, home, away, [1, 0]), "pair", json!(7));
    let mut all = vec![half("A", "B"), half("B", "A")];
    assert_eq!(score_tournament(&games(json!(all))).repeated_pairings, []);
    all.push(game(1, "A", "B", [1, 0]));
    let repeated = score_tournament(&games(json!(all))).repeated_pairings;
    assert_eq!((repeated.len(), repeated[0].games), (1, 2));
}
