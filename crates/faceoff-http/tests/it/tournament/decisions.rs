//! Tests of decisions during a tournament: withdrawal, disqualification, voiding, rerunning, pausing and closing.

use super::{
    cup::{TestTournament, first_by_name_wins, team_names},
    fake_worker::GameOutcome,
};
use crate::{
    site::{ADMIN, string},
    users::member,
};
use faceoff_store::{Actor, TournamentChange};
use faceoff_types::TournamentRules;
use serde_json::{Value, json};

/// The team's row in the standings of a tournament.
fn row<'a>(view: &'a Value, team: &str) -> &'a Value {
    let rows = view["tables"][0]["standings"].as_array().unwrap();
    rows.iter()
        .find(|row| row["team"] == team)
        .unwrap_or_else(|| panic!("{team} has no row in {view}"))
}

/// The names of the teams in the order of the standings.
fn ranked_names(view: &Value) -> Vec<String> {
    let rows = view["tables"][0]["standings"].as_array().unwrap();
    rows.iter().map(|row| string(&row["team"])).collect()
}

#[tokio::test]
async fn withdrawn_team_keeps_its_finished_rounds() {
    // By this rule, which tournaments of earlier versions have, a team leaves at once: its games of the running round do not count.
    let body = json!({ "rules": { "withdrawals": "at_once" } });
    let cup = TestTournament::open(&["A", "B", "C"], body).await;
    cup.start_round().await;
    cup.play(first_by_name_wins).await;
    cup.start_round().await;
    cup.play_next(first_by_name_wins).await.unwrap();
    let departure = json!({ "team": "A", "as": "withdrawn", "reason": "the arm is sold" });
    let unconfirmed = cup.post("departures", departure.clone()).await;
    let problem = unconfirmed.problem(
        409,
        "not-confirmed",
        &["A will be withdrawn", "the arm is sold"],
    );
    assert_eq!(problem["confirm"], "A");
    assert_eq!(
        cup.view().await["entrants"][0].get("departure"),
        None,
        "nothing has changed"
    );
    let mut confirmed = departure;
    confirmed["confirm"] = json!("A");
    let view = cup.post("departures", confirmed.clone()).await.json(200);
    let shown_departure = &view["entrants"][0]["departure"];
    assert_eq!(
        [
            &shown_departure["as"],
            &shown_departure["from_round"],
            &shown_departure["reason"]
        ],
        [&json!("withdrawn"), &json!(2), &json!("the arm is sold")]
    );
    assert_eq!(row(&view, "A")["points_per_round"][0], 6);
    cup.play(first_by_name_wins).await;
    let view = cup.view().await;
    assert_eq!(
        view["phase"], "played",
        "A's open games do not block the round"
    );
    // Of round 2 only the game of B and C counts, even if games with A were played.
    assert_eq!(row(&view, "A")["points_per_round"], json!([6, 0]));
    assert_eq!(row(&view, "B")["points_per_round"], json!([3, 3]));
    assert_eq!(row(&view, "C")["points_per_round"], json!([0, 0]));
    assert_eq!(row(&view, "A")["left"], "withdrawn");
    assert_eq!(
        ranked_names(&view),
        ["A", "B", "C"],
        "the withdrawn team keeps its rank"
    );
    for game in cup.games().await {
        let (home, away) = team_names(&game);
        let is_game_of_a = [home, away].contains(&"A".to_owned());
        if game["round"] == 2 && is_game_of_a {
            assert_eq!(game["excluded_by"], "A");
            assert_ne!(game["state"], "queued");
        } else {
            assert_eq!(game.get("excluded_by"), None);
            assert_eq!(game["state"], "played");
        }
    }
    cup.post("departures", confirmed)
        .await
        .problem(409, "conflict", &["has left"]);
}

#[tokio::test]
async fn withdrawn_team_plays_the_round_under_way() {
    let cup = TestTournament::open(&["A", "B", "C"], json!({})).await;
    assert_eq!(cup.view().await["rules"]["withdrawals"], "after_round");
    cup.start_round().await;
    cup.play_next(first_by_name_wins).await.unwrap();
    let departure =
        json!({ "team": "A", "as": "withdrawn", "reason": "the arm is sold", "confirm": "A" });
    let view = cup.post("departures", departure).await.json(200);
    assert_eq!(view["entrants"][0]["departure"]["from_round"], 2);
    assert_eq!(view["phase"], "round", "its games are still open: {view}");
    assert_eq!(cup.play(first_by_name_wins).await, 2);
    let view = cup.view().await;
    assert_eq!(row(&view, "A")["points_per_round"], json!([6]));
    assert_eq!(row(&view, "B")["points_per_round"], json!([3]));
    assert_eq!(view["phase"], "between");
    for game in cup.games().await {
        assert_eq!(
            (game.get("excluded_by"), &game["state"]),
            (None, &json!("played"))
        );
    }
    cup.start_round().await;
    let games = cup.games().await;
    let of_round_2 = games.iter().filter(|game| game["round"] == 2);
    assert_eq!(of_round_2.count(), 1, "only B and C are paired");
}

#[tokio::test]
async fn disqualified_team_is_last_and_loses_chosen_rounds() {
    let cup = TestTournament::open(&["A", "B", "C"], json!({})).await;
    for _ in 0..2 {
        cup.start_round().await;
        cup.play(first_by_name_wins).await;
    }
    let departure = |from_round: Value| json!({ "team": "A", "as": "disqualified", "reason": "it read the seed", "confirm": "A", "from_round": from_round });
    cup.post("departures", departure(json!(7)))
        .await
        .problem(409, "conflict", &["from_round"]);
    cup.post("departures", departure(json!(0))).await.problem(
        422,
        "invalid-content",
        &["from_round", "1 to 100"],
    );
    let view = cup.post("departures", departure(json!(2))).await.json(200);
    assert_eq!(ranked_names(&view), ["B", "C", "A"]);
    assert_eq!(row(&view, "A")["points_per_round"], json!([6, 0]));
    assert_eq!(row(&view, "B")["points_per_round"], json!([3, 3]));
    assert_eq!(row(&view, "A")["left"], "disqualified");
    assert_eq!(view["champion"], "B");
    let records = cup
        .site
        .get(&format!("{}/head-to-head", cup.path), None)
        .await
        .json(200);
    assert_eq!(
        records[0]["wins"],
        json!([1, 0]),
        "excluded games are in no record"
    );
}

#[tokio::test]
async fn team_is_withdrawn_by_a_member_not_by_its_token() {
    let cup = TestTournament::open(&["A", "B", "C"], json!({})).await;
    let path = format!("{}/withdrawal", cup.path);
    let body = json!({ "reason": "exams", "confirm": "A" });
    let by_token = cup.site.post(&path, Some(cup.token("A")), &body).await;
    by_token.problem(403, "forbidden", &["a member"]);
    cup.site
        .post(&path, Some(ADMIN), &body)
        .await
        .problem(403, "forbidden", &["departures"]);
    let ada = member(&cup.site, &cup.teams["A"].id, "Ada").await.token;
    cup.start_round().await;
    let unconfirmed = json!({ "reason": "exams" });
    cup.site
        .post(&path, Some(&ada), &unconfirmed)
        .await
        .problem(
            409,
            "not-confirmed",
            &[
                "A will be withdrawn",
                "games of a running round will still be played",
            ],
        );
    let view = cup.site.post(&path, Some(&ada), &body).await.json(200);
    assert_eq!(view["entrants"][0]["departure"]["as"], "withdrawn");
    let log = cup
        .site
        .get("/api/v1/events?kind=team_left_tournament", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(log["events"][0]["actor_name"], "Ada");
    assert_eq!(cup.play(first_by_name_wins).await, 3);
}

#[tokio::test]
async fn voided_game_is_rerun_on_the_same_seed() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    cup.start_round().await;
    let (claim, game, seed) = cup.claim().await.unwrap();
    cup.commit(&claim, &game, seed, GameOutcome::goals(5, 0))
        .await;
    let path = format!("/api/v1/games/{}", game.id);
    let decision = json!({ "reason": "a fan stood still" });
    let post = async |action: &str, body: &Value| {
        cup.site
            .post(&format!("{path}/{action}"), Some(ADMIN), body)
            .await
    };
    post("rerun", &json!({}))
        .await
        .problem(409, "conflict", &["voided"]);
    let [home, away] = cup.names(&game).await;
    let name = format!("{home} - {away}");
    let problem =
        post("void", &decision)
            .await
            .problem(409, "not-confirmed", &[&name, "same seed"]);
    assert_eq!(problem["confirm"], json!(name));
    let confirmed = json!({ "reason": "a fan stood still", "confirm": name });
    let voided = post("void", &confirmed).await.json(200);
    assert_eq!(
        (&voided["state"], &voided["reason"]),
        (&json!("void"), &json!("a fan stood still"))
    );
    let view = cup.view().await;
    assert_eq!(view["tables"][0]["standings"], json!([]));
    assert_eq!(view["phase"], "round");
    assert_eq!(view["rounds"][0]["progress"]["to_be_rerun"], 1);
    assert!(
        string(&view["next"]).contains("void or failed, to be rerun by an organiser: 1"),
        "{view}"
    );
    cup.post("rounds", json!({})).await.problem(
        409,
        "conflict",
        &["1 of its games have no result"],
    );
    cup.site
        .get(&format!("{path}/recording"), Some(ADMIN))
        .await
        .problem(409, "conflict", &["voided"]);
    post("void", &confirmed)
        .await
        .problem(409, "conflict", &["with a result can be voided"]);
    assert_eq!(post("rerun", &json!({})).await.json(200)["state"], "queued");
    let (claim, rerun, rerun_seed) = cup.claim().await.unwrap();
    assert_eq!(
        (rerun.id, rerun_seed),
        (game.id, seed),
        "the same game on the same seed"
    );
    cup.commit(&claim, &rerun, seed, GameOutcome::goals(0, 1))
        .await;
    let played = cup.site.get(&path, None).await.json(200);
    assert_eq!(
        (&played["attempt"], &played["result"]["winner"]),
        (&json!(2), &json!(away))
    );
    let attempts = cup
        .site
        .get(&format!("{path}/attempts"), Some(ADMIN))
        .await
        .json(200);
    let outcomes: Vec<&Value> = attempts
        .as_array()
        .unwrap()
        .iter()
        .map(|attempt| &attempt["end"])
        .collect();
    assert_eq!(
        outcomes,
        [&json!("played"), &json!("played")],
        "the list also has the attempt whose result was voided"
    );
    cup.start_round().await;
}

#[tokio::test]
async fn paused_tournament_finishes_running_games_only() {
    let cup = TestTournament::open(&["A", "B", "C"], json!({})).await;
    cup.start_round().await;
    let (claim, game, seed) = cup.claim().await.unwrap();
    cup.post("resume", json!({}))
        .await
        .problem(409, "conflict", &["not paused"]);
    cup.post("pause", json!({ "reason": "" }))
        .await
        .problem(422, "invalid-content", &["reason"]);
    let paused = cup
        .post("pause", json!({ "reason": "lunch" }))
        .await
        .json(200);
    assert_eq!(paused["paused"]["reason"], "lunch");
    assert!(
        string(&paused["next"]).starts_with("Paused (lunch)"),
        "{paused}"
    );
    cup.post("pause", json!({ "reason": "lunch" }))
        .await
        .problem(409, "conflict", &["paused"]);
    assert!(cup.claim().await.is_none());
    cup.commit(&claim, &game, seed, GameOutcome::goals(1, 0))
        .await;
    assert!(cup.claim().await.is_none());
    let queued = cup
        .games()
        .await
        .into_iter()
        .find(|game| game["state"] == "queued")
        .unwrap();
    assert!(string(&queued["next"]).contains("paused"));
    cup.post("resume", json!({})).await.json(200);
    assert_eq!(cup.play(first_by_name_wins).await, 2);
}

#[tokio::test]
async fn closed_tournament_does_not_change() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    let close = json!({ "confirm": "Cup" });
    cup.start_round().await;
    cup.post("close", close.clone())
        .await
        .problem(409, "conflict", &["1 games are queued"]);
    cup.play(first_by_name_wins).await;
    let unconfirmed = cup.post("close", json!({})).await;
    unconfirmed.problem(409, "not-confirmed", &["1 of 2 rounds started"]);
    let closed = cup.post("close", close.clone()).await.json(200);
    assert_eq!(closed["phase"], "closed");
    assert_eq!(
        closed["champion"],
        Value::Null,
        "only one of two rounds was played"
    );
    let game = string(&cup.games().await[0]["id"]);
    let void = json!({ "reason": "x", "confirm": "A - B" });
    let void_swapped = json!({ "reason": "x", "confirm": "B - A" });
    for answer in [
        cup.post("close", close).await,
        cup.post("rounds", json!({})).await,
        cup.post("pause", json!({ "reason": "x" })).await,
        cup.post("entrants", json!({ "teams": ["A"] })).await,
        cup.post("replays", json!({ "times": 1 })).await,
        cup.change(json!({ "name": "Other" })).await,
    ] {
        answer.problem(409, "conflict", &["closed"]);
    }
    for body in [void, void_swapped] {
        let path = format!("/api/v1/games/{game}/void");
        let answer = cup.site.post(&path, Some(ADMIN), &body).await;
        assert_eq!(answer.status, 409, "{}", answer.body);
    }
    assert_eq!(cup.games().await[0]["state"], "played");
}

#[tokio::test]
async fn rules_are_fixed_after_the_first_round_starts() {
    let cup = TestTournament::open(&["A", "B"], json!({ "rules": { "steps": 1500 } })).await;
    let changed = cup
        .change(json!({ "name": "Grand Cup", "rules": { "mirrored": true }, "settings": { "free_games_per_day": 1 } }))
        .await
        .json(200);
    assert_eq!(
        (
            &changed["name"],
            &changed["rules"]["steps"],
            &changed["rules"]["mirrored"]
        ),
        (&json!("Grand Cup"), &json!(1500), &json!(true)),
        "omitted settings do not change"
    );
    assert_eq!(
        changed["settings"],
        json!({ "free_games_per_day": 1, "publishes": "at_close" })
    );
    cup.start_round().await;
    cup.change(json!({ "rules": { "steps": 500 } }))
        .await
        .problem(409, "conflict", &["rules", "same rules"]);
    cup.change(json!({ "rules": { "steps": 1500 } }))
        .await
        .json(200);
    cup.change(json!({ "settings": { "publishes": "never" } }))
        .await
        .json(200);
}

#[tokio::test]
async fn null_restores_the_default_of_each_rule() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    let default_rules = cup.view().await["rules"].clone();
    let own = json!({
        "format": { "kind": "swiss", "rounds": 3 }, "steps": 1500, "profile": "ideal", "mirrored": true,
        "forfeit_score": "ten", "withdrawals": "at_once", "game_limits": { "max_faults": 5 },
        "perturbations": { "tracking_loss": { "probability": 0.5 } }, "limits": { "pids": 50 }, "runtimes": ["native"],
    });
    let changed = cup.change(json!({ "rules": own })).await.json(200);
    assert_ne!(changed["rules"], default_rules);
    let fields = own.as_object().unwrap().keys();
    let mut nulls: serde_json::Map<String, Value> =
        fields.map(|field| (field.clone(), Value::Null)).collect();
    nulls.insert("ruleset".to_owned(), Value::Null);
    let restored = cup.change(json!({ "rules": nulls })).await.json(200);
    assert_eq!(restored["rules"], default_rules);
}

#[tokio::test]
async fn tournament_keeps_its_ruleset_until_its_rules_change() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    let store = &cup.site.store;
    let opened = store.tournaments().await.unwrap().remove(0);
    // The change stores the tournament as a server with the previous ruleset would have stored it.
    let earlier_ruleset = TournamentChange {
        rules: Some(TournamentRules {
            ruleset: faceoff_airhockey::RULESETS[1],
            ..opened.rules
        }),
        ..TournamentChange::default()
    };
    let now = cup.site.now();
    store
        .change_tournament(Actor::Operator, opened.id, &earlier_ruleset, now)
        .await
        .unwrap();
    for rules in [
        json!({}),
        json!({ "mirrored": false }),
        json!({ "ruleset": "airhockey-2023.2" }),
        // Magnitudes that state the default.
        json!({ "perturbations": { "tracking_loss": { "probability": 0.03 } } }),
        json!({ "perturbations": { "tracking_loss": {} } }),
    ] {
        let unchanged = cup.change(json!({ "rules": rules })).await.json(200);
        assert_eq!(unchanged["rules"]["ruleset"], "airhockey-2023.2");
    }
    let with_old_ruleset = json!({ "ruleset": "airhockey-2023.2", "steps": 1500 });
    cup.change(json!({ "rules": with_old_ruleset }))
        .await
        .problem(
            422,
            "invalid-content",
            &["ruleset", "airhockey-2023.3", "leave it out"],
        );
    let changed = cup.change(json!({ "rules": { "steps": 1500 } })).await;
    assert_eq!(changed.json(200)["rules"]["ruleset"], "airhockey-2023.3");
}
