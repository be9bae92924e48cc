//! A tournament as its organiser, its teams and a visitor meet it, by the command line alone.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use crate::{
    CONFIG, Team,
    commands::{FAILED, MISUSED, NOT_ALLOWED, REFUSED, Told, admin, faceoff, member},
    people::joined,
};
use faceoff_tests::{bundle, server::Server};
use serde_json::Value;
use std::{fs::File, path::Path};
use zip::ZipArchive;

const TEAMS: [&str; 3] = ["Ada", "Bob", "Cyd"];

fn visitor(server: &Server, args: &[&str]) -> Told {
    let command = ["tournament", "--server", &server.url];
    faceoff(&[&command[..], args].concat(), "")
}

/// Until the tournament is in this phase.
fn in_phase(server: &Server, tournament: &Value, phase: &str) -> Value {
    let path = format!("/api/v1/tournaments/{}", tournament["id"].as_str().unwrap());
    server.poll(&path, &server.admin_token, |answer| {
        answer["phase"] == phase
    })
}

fn games(server: &Server) -> Vec<Value> {
    let told = visitor(server, &["games", "Cup", "--json"]).json();
    told.as_array().unwrap().clone()
}

fn id(of: &Value) -> &str {
    of["id"].as_str().unwrap()
}

/// The names of the two sides.
fn sides(game: &Value) -> [&str; 2] {
    [0, 1].map(|side| game["sides"][side]["team_name"].as_str().unwrap())
}

fn path(file: &Path) -> &str {
    file.to_str().unwrap()
}

#[test]
fn a_tournament_from_its_opening_to_its_close_by_the_command_line() {
    let scratch = tempfile::tempdir().unwrap();
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let teams = TEAMS.map(|name| Team::create(&server, name));
    let hold = bundle::reference("hold", scratch.path());
    let submissions = teams.each_ref().map(|team| {
        let submission = team.submit(&server, &hold);
        assert_eq!(submission["state"], "valid", "{submission:#}");
        submission
    });
    let as_ada = |command: &str, args: &[&str]| member(&server, &teams[0].token, command, args);

    // Open: rules, teams, and games that do not count.
    visitor(&server, &["show"]).not_done(FAILED, &["there is no tournament yet"]);
    let rules = [
        "--format",
        "round-robin",
        "--rounds",
        "1",
        "--steps",
        "1500",
    ];
    let open = ["tournament", "open", "Cup", "--teams", "Ada,Bob", "--json"];
    let cup = admin(&server, &[&open[..], &rules].concat()).json();
    assert_eq!(
        (&cup["phase"], &cup["rules"]["steps"]),
        (&"open".into(), &1500.into())
    );
    admin(&server, &[&open[..], &rules].concat()).not_done(REFUSED, &["409"]);
    admin(&server, &["tournament", "open", "Other", "--rounds", "3"])
        .not_done(MISUSED, &["--format"]);
    let entered = admin(&server, &["tournament", "enter", "cup", "Cyd"]).done();
    for words in [
        "Cup (open)",
        "Ada",
        "Bob",
        "Cyd",
        "1500 control steps",
        "starts round 1",
    ] {
        assert!(entered.contains(words), "{words:?} is not in {entered}");
    }
    as_ada("game", &["test"]).not_done(REFUSED, &["baseline"]);
    let baseline = [
        "tournament",
        "change",
        "Cup",
        "--baseline",
        id(&submissions[2]),
    ];
    let changed = admin(&server, &baseline).done();
    assert!(changed.contains(id(&submissions[2])), "{changed}");
    let bert = joined(&server, &["invite-member", "Bob", "Bert"], "Bert");
    let decline = ["change", "--declines-friendly-games", "true"];
    member(&server, &bert, "team", &decline).done();
    as_ada("game", &["friendly", "Bob"]).not_done(REFUSED, &["409", "Bob"]);
    let ordered = as_ada("game", &["--json", "test", "Cup"]).json();
    let test_game = id(&ordered["ordered"][0]).to_owned();
    let watched = as_ada("game", &["watch", &test_game]).done();
    assert!(
        watched.contains("over; it was played to its end"),
        "{watched}"
    );
    let own = as_ada("game", &["list"]).done();
    assert!(
        own.contains(&test_game) && own.contains("  test  "),
        "{own}"
    );
    // It is the two teams' alone.
    member(&server, &teams[1].token, "game", &["show", &test_game]).not_done(REFUSED, &["404"]);

    // The round.
    let round = admin(&server, &["tournament", "start-round", "Cup"]).done();
    assert!(round.contains("round 1"), "{round}");
    assert_eq!(round.matches("has nobody to play").count(), 3, "{round}");
    admin(&server, &["tournament", "start-round", "Cup"]).not_done(REFUSED, &["409"]);
    member(
        &server,
        &bert,
        "tournament",
        &["withdraw", "Cup", "too tired"],
    )
    .not_done(REFUSED, &["409", "Bob", "too tired"]);
    in_phase(&server, &cup, "played");
    let shown = visitor(&server, &["show"]).done();
    for words in [
        "all rounds are over, champion ",
        "3 of 3 games played",
        "points per round",
    ] {
        assert!(shown.contains(words), "{words:?} is not in {shown}");
    }
    let played = games(&server);
    assert_eq!(played.len(), 3);
    let table = visitor(&server, &["games", "--round", "1"]).done();
    for game in &played {
        assert_eq!(game["result"]["steps"], 1500, "{game:#}");
        assert!(table.contains(id(game)), "{table}");
    }
    let ratings = visitor(&server, &["ratings"]).done();
    for words in ["A wins", "ratings by results", "Bradley-Terry"] {
        assert!(ratings.contains(words), "{words:?} is not in {ratings}");
    }
    let certainty = visitor(&server, &["certainty"]).done();
    assert!(certainty.contains("was not played again"), "{certainty}");

    // A side's own file at once, both sides' for the organiser, who verifies it.
    let of_ada = played
        .iter()
        .find(|game| sides(game).contains(&"Ada"))
        .unwrap();
    let number = 1 + sides(of_ada)
        .iter()
        .position(|name| *name == "Ada")
        .unwrap();
    let file = scratch.path().join("own.zip");
    as_ada("game", &["download", id(of_ada), path(&file)]).done();
    let mut own = ZipArchive::new(File::open(&file).unwrap()).unwrap();
    assert!(own.by_name(&format!("side-{number}.parquet")).is_ok());
    assert!(
        own.by_name(&format!("side-{}.parquet", 3 - number))
            .is_err()
    );
    let both = scratch.path().join("both.zip");
    as_ada("game", &["download", id(of_ada), path(&both), "--both"])
        .not_done(NOT_ALLOWED, &["403"]);
    let log = as_ada("game", &["log", id(of_ada)]);
    assert_eq!(log.code, Some(0));
    let as_organiser = |args: &[&str]| member(&server, &server.admin_token, "game", args);
    as_organiser(&["download", id(of_ada), path(&both), "--both"]).done();
    let known = as_organiser(&["show", id(of_ada), "--json"]).json();
    let recording = &known["result"]["recording"];
    let hash = recording["game_blake3"].as_str().unwrap();
    let verified = faceoff(&["verify", path(&both), "--blake3", hash, "--json"], "").json();
    assert_eq!(verified["verified"], true);
    assert_eq!(verified["result"]["seed"], recording["seed"]);

    // A game is void, and played again on the same seed.
    let void = ["tournament", "void", id(of_ada), "a camera fell down"];
    let name = sides(of_ada).join(" - ");
    admin(&server, &void).not_done(REFUSED, &["409", &name]);
    let confirmed = [&void[..], &["--confirm", &name]].concat();
    let voided = admin(&server, &confirmed).done();
    assert!(voided.contains("void: a camera fell down"), "{voided}");
    let shown = visitor(&server, &["show"]).done();
    assert!(
        shown.contains("1 void or broken, to be played again"),
        "{shown}"
    );
    admin(&server, &["tournament", "rerun", id(of_ada)]).done();
    in_phase(&server, &cup, "played");
    let again = as_organiser(&["show", id(of_ada), "--json"]).json();
    assert_eq!(
        (&again["state"], &again["attempt"]),
        (&"played".into(), &2.into())
    );
    assert_eq!(again["result"]["recording"]["seed"], recording["seed"]);
    assert_eq!(again["sides"], known["sides"]);
    let attempts = admin(&server, &["tournament", "attempts", id(of_ada)]).done();
    assert_eq!(attempts.lines().count(), 2, "{attempts}");

    // Closed, it is public.
    admin(&server, &["tournament", "close", "Cup"]).not_done(REFUSED, &["409", "Cup"]);
    let closed = admin(&server, &["tournament", "close", "Cup", "--confirm", "Cup"]).done();
    assert!(closed.contains("Cup (closed"), "{closed}");
    let public = scratch.path().join("public.zip");
    let download = ["game", "--server", &server.url, "download"];
    let download = [&download[..], &[id(of_ada), path(&public), "--both"]].concat();
    faceoff(&download, "").done();
    faceoff(&["verify", path(&public)], "").done();
    let hash = again["result"]["recording"]["game_blake3"]
        .as_str()
        .unwrap();
    faceoff(&["verify", path(&public), "--blake3", hash], "").done();
    admin(&server, &["tournament", "rerun", id(of_ada)]).not_done(REFUSED, &["409"]);
}
