//! Tests of divisions, which are groups of teams with a ranking of their own, on boards.

use crate::{
    html::texts,
    site::{ADMIN, Site, result},
};
use scraper::Selector;
use serde_json::{Value, json};

/// Changes a resource as an organiser. The request must succeed.
async fn patch(site: &Site, path: &str, body: &Value) -> Value {
    let path = format!("/api/v1{path}");
    site.patch(&path, Some(ADMIN), body).await.json(200)
}

/// Four teams in the board order A, B, C, D. A and C are students, B is open, D has no division.
async fn season_with_divisions() -> Site {
    let site = Site::start().await;
    let teams = [
        ("A", result([0.9, 0.9, 0.9], 10.0)),
        ("B", result([0.6, 0.6, 0.6], 20.0)),
        ("C", result([0.3, 0.3, 0.3], 30.0)),
        ("D", result([0.1, 0.1, 0.1], 40.0)),
    ];
    site.add_ranked_teams(&teams).await;
    let divisions = json!({ "divisions": ["Open", "Bachelor students"] });
    patch(&site, "/season", &divisions).await;
    for (name, division) in [
        ("A", "Bachelor students"),
        ("B", "Open"),
        ("C", "Bachelor students"),
    ] {
        let id = team_id(&site, name).await;
        patch(
            &site,
            &format!("/teams/{id}"),
            &json!({ "division": division }),
        )
        .await;
    }
    site
}

async fn team_id(site: &Site, name: &str) -> String {
    let teams = site.get("/api/v1/teams", Some(ADMIN)).await.json(200);
    let teams = teams.as_array().unwrap();
    let team = teams.iter().find(|team| team["name"] == name).unwrap();
    team["id"].as_str().unwrap().to_owned()
}

/// Rank, rank group and team of each row.
fn ranked_rows(board: &Value) -> Vec<(u64, u64, String)> {
    let rows = board["rows"].as_array().unwrap().iter();
    rows.map(|row| {
        let number = |key: &str| row[key].as_u64().unwrap();
        let team = row["team"].as_str().unwrap().to_owned();
        (number("rank"), number("rank_group"), team)
    })
    .collect()
}

fn team_names(rows: &[(u64, u64, String)]) -> Vec<&str> {
    rows.iter().map(|(_, _, team)| team.as_str()).collect()
}

#[tokio::test]
async fn divisions_keep_their_order_and_teams() {
    let site = Site::start().await;
    let change_season =
        async |change: Value| site.patch("/api/v1/season", Some(ADMIN), &change).await;
    let set_divisions = async |names: &[&str]| change_season(json!({ "divisions": names })).await;
    set_divisions(&["Open", "Students"]).await.json(200);
    set_divisions(&["Students", "Open"]).await.json(200);
    let stored = site.get("/api/v1/season", None).await.json(200)["divisions"].clone();
    assert_eq!(stored, json!(["Students", "Open"]));
    set_divisions(&["Open", "OPEN"])
        .await
        .problem(409, "conflict", &["“OPEN” is listed twice"]);
    change_season(json!({ "takes_registrations": true }))
        .await
        .json(200);
    let registration =
        json!({ "team": { "name": "Beta", "division": "open" }, "contact": "ada@example.org" });
    let registered = site.post("/api/v1/registrations", None, &registration);
    let registered = registered.await.json(201);
    assert_eq!(registered["division"], "Open");
    let approve = format!(
        "/api/v1/registrations/{}/approve",
        registered["id"].as_str().unwrap()
    );
    site.post(&approve, Some(ADMIN), &json!({})).await.json(200);
    set_divisions(&["Students"])
        .await
        .problem(409, "conflict", &["“Open” has 1 teams"]);
    assert_eq!(
        site.get("/api/v1/season", None).await.json(200)["divisions"],
        stored
    );
}

#[tokio::test]
async fn board_without_divisions_is_unchanged() {
    let site = Site::start().await;
    let alpha = [("Alpha", result([0.9, 0.9, 0.9], 10.0))];
    site.add_ranked_teams(&alpha).await;
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(ranked_rows(&board), [(1, 1, "Alpha".to_owned())]);
    assert!(!board.to_string().contains("division"), "{board}");
    let page = site.get("/", None).await.body.to_lowercase();
    assert!(!page.contains("division"));
    for path in ["/api/v1/board", "/api/v1/board/hit"] {
        let refused = site.get(&format!("{path}?division=Open"), None).await;
        let problem = refused.problem(
            404,
            "not-found",
            &["no divisions", "got “Open”; leave it out"],
        );
        assert_eq!(problem["divisions"], json!([]));
    }
}

#[tokio::test]
async fn board_of_a_division_ranks_its_teams() {
    let site = season_with_divisions().await;
    let all_teams = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(team_names(&ranked_rows(&all_teams)), ["A", "B", "C", "D"]);
    assert!(all_teams.get("division").is_none());
    let divisions: Vec<_> = all_teams["rows"].as_array().unwrap().iter().collect();
    let divisions: Vec<_> = divisions.iter().map(|row| row.get("division")).collect();
    let (open, students) = (json!("Open"), json!("Bachelor students"));
    assert_eq!(
        divisions,
        [Some(&students), Some(&open), Some(&students), None]
    );

    // The name is not case-sensitive. It works on overall and task boards, with a stage and a revision.
    let stage = site.stage().await;
    for path in [
        "/api/v1/board?division=Bachelor%20students",
        "/api/v1/board/hit?division=bachelor+STUDENTS",
        &format!("/api/v1/board?stage={stage}&revision=1&division=Bachelor%20students"),
    ] {
        let board = site.get(path, None).await.json(200);
        assert_eq!(board["division"], "Bachelor students", "{path}");
        let rows = ranked_rows(&board);
        assert_eq!(team_names(&rows), ["A", "C"], "{path}");
        let ranks: Vec<_> = rows.iter().map(|(rank, ..)| *rank).collect();
        assert_eq!(ranks, [1, 2], "{path}");
        assert_eq!(
            rows[0].1, 1,
            "{path}: rank groups are counted within the division"
        );
    }

    let open = site.get("/api/v1/board?division=open", None).await;
    assert_eq!(ranked_rows(&open.json(200)), [(1, 1, "B".to_owned())]);

    for path in ["/api/v1/board", "/api/v1/board/prepare"] {
        let refused = site.get(&format!("{path}?division=Pupils"), None).await;
        let words = ["expected “Open” or “Bachelor students”, got “Pupils”"];
        let problem = refused.problem(404, "not-found", &words);
        assert_eq!(problem["divisions"], json!(["Open", "Bachelor students"]));
        for wrong in ["", "%3Cb%3E", "%20Open"] {
            let refused = site.get(&format!("{path}?division={wrong}"), None).await;
            refused.problem(400, "invalid-request", &["division"]);
        }
    }

    // A disqualified team leaves its division's board, and is listed on no other division's board.
    let id = team_id(&site, "C").await;
    let decision = json!({ "reason": "two bundles", "confirm": "C" });
    let path = format!("/api/v1/teams/{id}/disqualify");
    site.post(&path, Some(ADMIN), &decision).await.json(200);
    for (division, remaining, disqualified) in [
        ("Bachelor%20students", &["A"][..], 1),
        ("Open", &["B"][..], 0),
    ] {
        let path = format!("/api/v1/board?division={division}");
        let board = site.get(&path, None).await.json(200);
        assert_eq!(team_names(&ranked_rows(&board)), remaining);
        let listed = board["disqualified"].as_array().unwrap();
        assert_eq!(listed.len(), disqualified, "{division}");
    }
}

#[tokio::test]
async fn board_pages_link_to_divisions() {
    let site = season_with_divisions().await;
    let page = async |path: &str| site.get(path, None).await.html(200);
    for path in ["/", "/tasks/hit"] {
        let all_teams = page(path).await;
        assert_eq!(
            texts(&all_teams, ".board th.team > a"),
            ["A", "B", "C", "D"]
        );
        let notes = texts(&all_teams, ".board th.team .note");
        for (note, division) in notes.iter().zip(["Bachelor students", "Open"]) {
            assert!(note.starts_with(&format!("{division} · ")), "{note}");
        }
        let links = Selector::parse(".lead a").unwrap();
        let links: Vec<_> = all_teams.select(&links).collect();
        let link_target = |name: &str| {
            let link = links.iter().find(|link| link.text().eq([name]));
            let link = link.unwrap_or_else(|| panic!("no link {name:?}"));
            format!("{path}{}", link.attr("href").unwrap())
        };
        let students = page(&link_target("Bachelor students")).await;
        assert_eq!(texts(&students, ".board th.team > a"), ["A", "C"]);
        assert_eq!(texts(&students, ".board td.rank"), ["1=", "1="]);
        let lead = texts(&students, ".lead").join(" ");
        assert!(lead.contains("Division Bachelor students"), "{lead}");
        let unknown = site.get(&format!("{path}?division=Pupils"), None).await;
        assert_eq!(unknown.status, 404);
        assert!(unknown.body.contains("“Bachelor students”"));
    }
    patch(
        &site,
        "/season",
        &json!({ "divisions": ["Open", "Bachelor students", "Pupils"] }),
    )
    .await;
    site.next_day();
    site.start_day().await;
    let under_way = texts(&page("/?division=open").await, ".under-way p > a");
    assert_eq!(under_way, ["B"]);
    assert_eq!(texts(&page("/").await, ".under-way p > a").len(), 4);
    let empty = page("/?division=pupils").await;
    let empty = texts(&empty, "#empty").join(" ");
    assert_eq!(empty, "No team of the division has a result yet");
}
