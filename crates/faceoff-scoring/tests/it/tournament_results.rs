//! Tests of forfeits, departures, byes and head-to-head records, on synthetic games.

use crate::support::{read, team};
use faceoff_scoring::tournament::{
    Bye, Departure, DepartureKind, Departures, PlayedGame, RoundNumber, Tournament, head_to_head,
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

/// The game with another value of a field.
fn with_field(mut game: Value, field: &str, value: Value) -> Value {
    game[field] = value;
    game
}

/// `[team, points, goals for, goals against]` for each row.
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

fn departure(name: &str, kind: DepartureKind, from_round: u32) -> Departure {
    Departure {
        team: team(name),
        kind,
        from_round: round(from_round),
    }
}

#[test]
fn forfeited_game_counts_10_to_0() {
    let unsafe_home = with_field(game(1, "A", "B", [1, 7]), "penalty_points", json!([900, 0]));
    let played = games(json!([
        with_field(unsafe_home, "forfeit", json!([null, "faults"])),
        with_field(
            game(1, "C", "D", [3, 0]),
            "forfeit",
            json!(["time", "faults"])
        ),
    ]));
    let tournament = score_tournament(&played);
    let written = serde_json::to_value(&tournament.games[0]).unwrap();
    // `winner_led`: was the winner ahead before the forfeit? A was not, with 1 : 7 goals.
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
fn forfeit_that_contradicts_score_is_refused() {
    let forfeited = with_field(game(1, "A", "B", [1, 7]), "forfeit", json!([null, "time"]));
    for (changed, words) in [
        (
            with_field(forfeited.clone(), "score", json!([1, 7])),
            "counts [10, 0], got [1, 7]",
        ),
        (
            with_field(forfeited.clone(), "forfeit", json!([null, "sleep"])),
            "unknown variant `sleep`, expected `faults` or `time`",
        ),
        (
            with_field(
                with_field(forfeited.clone(), "fouls", Value::Null),
                "score",
                json!([10, 0]),
            ),
            "a forfeited game needs its fouls",
        ),
    ] {
        let error = read::<Vec<PlayedGame>>(&json!([changed]).to_string()).unwrap_err();
        assert!(error.contains(words), "{words:?} is not in: {error}");
    }
    games(json!([with_field(forfeited, "score", json!([10, 0]))]));
}

#[test]
fn departure_excludes_games_of_unfinished_round() {
    let played = games(json!([
        game(1, "A", "B", [0, 1]),
        game(1, "B", "C", [2, 0]),
        game(1, "C", "A", [0, 3]),
        // B leaves in this round: it has met A, but not C.
        game(2, "B", "A", [0, 9]),
        game(2, "A", "C", [1, 0]),
    ]));
    let departures = Departures::new([departure("B", DepartureKind::Withdrawn, 2)]).unwrap();
    let tournament = score_tournament_with(&played, &departures, &[]);
    assert_eq!(
        table(&tournament),
        json!([["A", 6, 4, 1], ["B", 6, 3, 0], ["C", 0, 0, 6]]),
        "A has three for the first round's win over C and three for the second's, none for the 9 : 0"
    );
    let excluded_by: Vec<_> = tournament
        .games
        .iter()
        .map(|game| game.excluded_by.clone())
        .collect();
    assert_eq!(excluded_by, [None, None, None, Some(team("B")), None]);
    let row = serde_json::to_value(&tournament.standings[1]).unwrap();
    assert_eq!(row["left"], "withdrawn");
    assert_eq!(row["points_per_round"], json!([6, 0]));
    assert_eq!(departures.counting_games(&played).count(), 4);
}

#[test]
fn disqualified_team_is_last_and_may_lose_all_games() {
    let played = games(json!([
        game(1, "A", "B", [0, 1]),
        game(1, "B", "C", [2, 0]),
        game(1, "C", "A", [0, 3]),
    ]));
    let table_from = |from| {
        let departures =
            Departures::new([departure("B", DepartureKind::Disqualified, from)]).unwrap();
        table(&score_tournament_with(&played, &departures, &[]))
    };
    assert_eq!(
        table_from(2),
        json!([["A", 3, 3, 1], ["C", 0, 0, 5], ["B", 6, 3, 0]])
    );
    assert_eq!(
        table_from(1),
        json!([["A", 3, 3, 0], ["C", 0, 0, 3], ["B", 0, 0, 0]])
    );
}

#[test]
fn duplicate_departure_and_invalid_round_are_refused() {
    let duplicate = [
        departure("A", DepartureKind::Withdrawn, 1),
        departure("A", DepartureKind::Disqualified, 2),
    ];
    let error = Departures::new(duplicate).unwrap_err().to_string();
    assert_eq!(error, "A has two departures; keep the one that counts");
    for number in [0, 101] {
        let error = RoundNumber::try_from(number).unwrap_err().to_string();
        assert_eq!(error, format!("expected 1 to 100, got {number}"));
    }
}

#[test]
fn bye_gives_points_without_game() {
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
    // Like games, byes do not count from the round of the departure.
    let departures = Departures::new([Departure {
        team: team("C"),
        kind: DepartureKind::Withdrawn,
        from_round: round(3),
    }]);
    let tournament = score_tournament_with(&played, &departures.unwrap(), &byes);
    let row_c = tournament
        .standings
        .iter()
        .find(|row| row.team == team("C"));
    assert_eq!(row_c.map(|row| (row.points, row.byes)), Some((3, 1)));
}

#[test]
fn head_to_head_record_combines_home_and_away_games() {
    let forfeited = with_field(game(2, "A", "B", [0, 4]), "forfeit", json!([null, "time"]));
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
fn mirrored_pair_is_no_repeated_pairing() {
    let half = |home, away| with_field(game(1, home, away, [1, 0]), "pair", json!(7));
    let mut entries = vec![half("A", "B"), half("B", "A")];
    assert_eq!(
        score_tournament(&games(json!(entries))).repeated_pairings,
        []
    );
    entries.push(game(1, "A", "B", [1, 0]));
    let repeated = score_tournament(&games(json!(entries))).repeated_pairings;
    assert_eq!((repeated.len(), repeated[0].games), (1, 2));
}
