//! A whole tournament on the command line, as organiser, teams and visitor: opening, test games, a round, downloads, a repeated
//! game, and the close.

#![expect(clippy::unwrap_used, reason = "a test that cannot continue fails")]

use crate::{
    CONFIG, Team,
    commands::{CommandOutput, FAILED, NOT_ALLOWED, REFUSED, USAGE_ERROR, admin, faceoff, member},
    users::invite_and_join,
};
use faceoff_tests::{bundle, repository, server::Server};
use serde_json::Value;
use std::{fs::File, path::Path};
use zip::ZipArchive;

const TEAMS: [&str; 3] = ["Ada", "Bob", "Cyd"];

/// Arguments that open the tournament “Cup” of Ada and Bob, with one round of short games (1500 control steps).
pub(crate) const OPEN_CUP: [&str; 12] = [
    "tournament",
    "open",
    "Cup",
    "--teams",
    "Ada,Bob",
    "--json",
    "--format",
    "round-robin",
    "--rounds",
    "1",
    "--steps",
    "1500",
];

/// Creates teams with a valid submission of the agent `hold`.
pub(crate) fn create_teams_with_hold(server: &Server, names: &[&str]) {
    for name in names {
        let team = Team::create(server, name);
        let submission = team.submit(server, &repository().join("agents/hold"));
        assert_eq!(submission["state"], "valid", "{submission:#}");
    }
}

/// `faceoff tournament` without a token.
fn visitor_command(server: &Server, args: &[&str]) -> CommandOutput {
    let command = ["tournament", "--server", &server.url];
    faceoff(&[&command[..], args].concat(), "")
}

/// Waits until the tournament is in this phase. `played` means that all games of the started rounds are finished.
fn wait_for_phase(server: &Server, tournament: &Value, phase: &str) -> Value {
    let path = format!("/api/v1/tournaments/{}", tournament["id"].as_str().unwrap());
    server.poll(&path, &server.admin_token, |answer| {
        answer["phase"] == phase
    })
}

fn public_games(server: &Server) -> Vec<Value> {
    let games = visitor_command(server, &["games", "Cup", "--json"]).json();
    games.as_array().unwrap().clone()
}

fn id(value: &Value) -> &str {
    value["id"].as_str().unwrap()
}

/// The names of the two teams of a game.
fn team_names(game: &Value) -> [&str; 2] {
    [0, 1].map(|side| game["sides"][side]["team_name"].as_str().unwrap())
}

fn path_text(file: &Path) -> &str {
    file.to_str().unwrap()
}

#[test]
fn commands_run_a_tournament_from_opening_to_close() {
    let scratch = tempfile::tempdir().unwrap();
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let teams = TEAMS.map(|name| Team::create(&server, name));
    let hold = bundle::example_agent("hold", scratch.path());
    let submissions = teams.each_ref().map(|team| {
        let submission = team.submit(&server, &hold);
        assert_eq!(submission["state"], "valid", "{submission:#}");
        submission
    });
    let as_ada = |command: &str, args: &[&str]| member(&server, &teams[0].token, command, args);

    // Opening: rules, teams, and games that do not count. A test game needs a baseline, a submission that the organiser names.
    visitor_command(&server, &["show"]).expect_refusal(FAILED, &["there is no tournament yet"]);
    let cup = admin(&server, &OPEN_CUP).json();
    assert_eq!(
        (&cup["phase"], &cup["rules"]["steps"]),
        (&"open".into(), &1500.into())
    );
    admin(&server, &OPEN_CUP).expect_refusal(REFUSED, &["409"]);
    admin(&server, &["tournament", "open", "Other", "--rounds", "3"])
        .expect_refusal(USAGE_ERROR, &["--format"]);
    let entered = admin(&server, &["tournament", "enter", "cup", "Cyd"]).expect_success();
    for text in [
        "Cup (open)",
        "Ada",
        "Bob",
        "Cyd",
        "1500 control steps",
        "starts round 1",
    ] {
        assert!(entered.contains(text), "{text:?} is not in {entered}");
    }
    as_ada("game", &["test"]).expect_refusal(REFUSED, &["baseline"]);
    let baseline = [
        "tournament",
        "change",
        "Cup",
        "--baseline",
        id(&submissions[2]),
    ];
    let changed = admin(&server, &baseline).expect_success();
    assert!(changed.contains(id(&submissions[2])), "{changed}");
    // The token of a member of the team Bob, which accepts no friendly games.
    let bert = invite_and_join(&server, &["invite-member", "Bob", "Bert"], "Bert");
    let decline_friendly_games = ["change", "--declines-friendly-games", "true"];
    member(&server, &bert, "team", &decline_friendly_games).expect_success();
    as_ada("game", &["friendly", "Bob"]).expect_refusal(REFUSED, &["409", "Bob"]);
    let requested = as_ada("game", &["--json", "test", "Cup"]).json();
    let test_game = id(&requested["queued"][0]).to_owned();
    let watched = as_ada("game", &["watch", &test_game]).expect_success();
    assert!(watched.contains("over: faceoff game show"), "{watched}");
    let own_games = as_ada("game", &["list"]).expect_success();
    assert!(
        own_games.contains(&test_game) && own_games.contains("  test  "),
        "{own_games}"
    );
    // A test game is visible to its team alone.
    member(&server, &teams[1].token, "game", &["show", &test_game])
        .expect_refusal(REFUSED, &["404"]);

    // The round. Each of the three teams plays the other two, and has one bye.
    let round = admin(&server, &["tournament", "start-round", "Cup"]).expect_success();
    assert!(round.contains("round 1"), "{round}");
    assert_eq!(round.matches(": bye for ").count(), 3, "{round}");
    admin(&server, &["tournament", "start-round", "Cup"]).expect_refusal(REFUSED, &["409"]);
    member(
        &server,
        &bert,
        "tournament",
        &["withdraw", "Cup", "too tired"],
    )
    .expect_refusal(REFUSED, &["409", "Bob", "too tired"]);
    wait_for_phase(&server, &cup, "played");
    let shown = visitor_command(&server, &["show"]).expect_success();
    for text in [
        "all rounds finished, champion ",
        "3 of 3 games played",
        "points per round",
    ] {
        assert!(shown.contains(text), "{text:?} is not in {shown}");
    }
    let played = public_games(&server);
    assert_eq!(played.len(), 3);
    let table = visitor_command(&server, &["games", "--round", "1"]).expect_success();
    for game in &played {
        assert_eq!(game["result"]["steps"], 1500, "{game:#}");
        assert!(table.contains(id(game)), "{table}");
    }
    let ratings = visitor_command(&server, &["ratings"]).expect_success();
    for text in ["A wins", "ratings by results", "Bradley-Terry"] {
        assert!(ratings.contains(text), "{text:?} is not in {ratings}");
    }
    // How often each team would be champion in replays of the schedule.
    let champion_shares = visitor_command(&server, &["certainty"]).expect_success();
    assert!(
        champion_shares.contains("has not been replayed"),
        "{champion_shares}"
    );

    // A team can download its own side's file, the organiser those of both sides. The organiser verifies them.
    let ada_game = played
        .iter()
        .find(|game| team_names(game).contains(&"Ada"))
        .unwrap();
    // Sides are numbered from 1; the other side is 3 - this one.
    let ada_side = 1 + team_names(ada_game)
        .iter()
        .position(|name| *name == "Ada")
        .unwrap();
    let file = scratch.path().join("own.zip");
    as_ada("game", &["download", id(ada_game), path_text(&file)]).expect_success();
    let mut own_file = ZipArchive::new(File::open(&file).unwrap()).unwrap();
    assert!(
        own_file
            .by_name(&format!("side-{ada_side}.parquet"))
            .is_ok()
    );
    assert!(
        own_file
            .by_name(&format!("side-{}.parquet", 3 - ada_side))
            .is_err()
    );
    let both_sides = scratch.path().join("both.zip");
    as_ada(
        "game",
        &["download", id(ada_game), path_text(&both_sides), "--both"],
    )
    .expect_refusal(NOT_ALLOWED, &["403"]);
    let log = as_ada("game", &["log", id(ada_game)]);
    assert_eq!(log.code, Some(0));
    let as_organiser = |args: &[&str]| member(&server, &server.admin_token, "game", args);
    as_organiser(&["download", id(ada_game), path_text(&both_sides), "--both"]).expect_success();
    let original = as_organiser(&["show", id(ada_game), "--json"]).json();
    let recording = &original["result"]["recording"];
    let hash = recording["game_blake3"].as_str().unwrap();
    let verified = faceoff(
        &["verify", path_text(&both_sides), "--blake3", hash, "--json"],
        "",
    )
    .json();
    assert_eq!(verified["verified"], true);
    assert_eq!(verified["result"]["seed"], recording["seed"]);

    // A void game is repeated with the same seed.
    let void = ["tournament", "void", id(ada_game), "a camera fell down"];
    let confirmation = team_names(ada_game).join(" - ");
    admin(&server, &void).expect_refusal(REFUSED, &["409", &confirmation]);
    let confirmed_void = [&void[..], &["--confirm", &confirmation]].concat();
    let voided = admin(&server, &confirmed_void).expect_success();
    assert!(voided.contains("void: a camera fell down"), "{voided}");
    let shown = visitor_command(&server, &["show"]).expect_success();
    assert!(shown.contains("1 to be repeated"), "{shown}");
    admin(&server, &["tournament", "rerun", id(ada_game)]).expect_success();
    wait_for_phase(&server, &cup, "played");
    let repeated = as_organiser(&["show", id(ada_game), "--json"]).json();
    assert_eq!(
        (&repeated["state"], &repeated["attempt"]),
        (&"played".into(), &2.into())
    );
    assert_eq!(repeated["result"]["recording"]["seed"], recording["seed"]);
    assert_eq!(repeated["sides"], original["sides"]);
    let attempts = admin(&server, &["tournament", "attempts", id(ada_game)]).expect_success();
    assert_eq!(attempts.lines().count(), 2, "{attempts}");

    // After the tournament is closed, its games are public.
    admin(&server, &["tournament", "close", "Cup"]).expect_refusal(REFUSED, &["409", "Cup"]);
    let closed =
        admin(&server, &["tournament", "close", "Cup", "--confirm", "Cup"]).expect_success();
    assert!(closed.contains("Cup (closed"), "{closed}");
    let public = scratch.path().join("public.zip");
    let download = ["game", "--server", &server.url, "download"];
    let download = [&download[..], &[id(ada_game), path_text(&public), "--both"]].concat();
    faceoff(&download, "").expect_success();
    faceoff(&["verify", path_text(&public)], "").expect_success();
    let hash = repeated["result"]["recording"]["game_blake3"]
        .as_str()
        .unwrap();
    faceoff(&["verify", path_text(&public), "--blake3", hash], "").expect_success();
    admin(&server, &["tournament", "rerun", id(ada_game)]).expect_refusal(REFUSED, &["409"]);
}
