//! Tests of baselines, the organisers' reference agents, which boards show beside the ranked teams.

use crate::site::{ADMIN, Answer, Site, TestTeam, string};
use serde_json::{Value, json};

async fn change_team(site: &Site, team: &TestTeam, token: &str, change: &Value) -> Answer {
    let path = format!("/api/v1/teams/{}", team.id);
    site.patch(&path, Some(token), change).await
}

/// Three teams with results; "Reference" is in the middle.
async fn three_teams(site: &Site) -> [TestTeam; 3] {
    let teams = [
        site.team("Alpha").await,
        site.team("Reference").await,
        site.team("Beta").await,
    ];
    for team in &teams {
        site.valid_submission(team, "a").await;
    }
    site.run_day_with_rates(&[0.9, 0.7, 0.5]).await;
    teams
}

#[tokio::test]
async fn baseline_takes_no_rank_from_teams() {
    let site = Site::start().await;
    let [_, reference, _] = three_teams(&site).await;
    let names = |board: &Value| -> Vec<(u64, String)> {
        let rows = board["rows"].as_array().unwrap().iter();
        rows.map(|row| (row["rank"].as_u64().unwrap(), string(&row["team"])))
            .collect()
    };
    let before = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(names(&before)[2], (3, "Beta".to_owned()));
    assert_eq!(before["baselines"], json!([]));
    let mark = json!({ "baseline": true });
    let marked = change_team(&site, &reference, ADMIN, &mark).await.json(200);
    assert_eq!(marked["baseline"], true);
    for path in ["/api/v1/board", "/api/v1/board/hit"] {
        let board = site.get(path, None).await.json(200);
        let expected = [(1, "Alpha".to_owned()), (2, "Beta".to_owned())];
        assert_eq!(names(&board), expected);
        let baseline = &board["baselines"][0];
        assert_eq!(baseline["team"], "Reference");
        assert_eq!(baseline["baseline"], true);
        assert_eq!(baseline["would_rank"], 2);
        assert_eq!(baseline["score"].as_f64(), Some(70.0));
        assert_eq!(baseline.get("rank"), None);
        let table = site.get(&format!("{path}?format=csv"), None).await.body;
        let mut lines = csv::Reader::from_reader(table.as_bytes());
        let columns = lines.headers().unwrap().clone();
        let last_line = lines.records().last().unwrap().unwrap();
        let field = |name: &str| {
            let index = columns.iter().position(|column| column == name).unwrap();
            last_line[index].to_owned()
        };
        let fields = ["rank", "baseline", "would_rank", "team"].map(field);
        assert_eq!(fields, ["", "true", "2", "Reference"]);
    }
    let history = site.get("/api/v1/board/history", None).await.json(200);
    let last_row = &history["rows"][2];
    assert_eq!(
        (&last_row["team"], &last_row["rank"]),
        (&json!("Reference"), &Value::Null)
    );
    assert_eq!(
        (&last_row["baseline"], &last_row["would_rank"]),
        (&json!(true), &json!(2))
    );
    for page in ["/", "/tasks/hit"] {
        let page = site.get(page, None).await.body;
        assert!(
            page.contains("<h2 id=\"baselines\">Baselines</h2>"),
            "{page}"
        );
        assert!(page.contains("(2)"), "{page}");
    }
    let events_path = "/api/v1/events?kind=team_made_baseline";
    let log = site.get(events_path, Some(ADMIN)).await.json(200);
    assert_eq!(log["events"].as_array().unwrap().len(), 1);
    let unmark = json!({ "baseline": false });
    let unmarked = change_team(&site, &reference, ADMIN, &unmark)
        .await
        .json(200);
    assert_eq!(unmarked.get("baseline"), None);
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(names(&board), names(&before));
}

#[tokio::test]
async fn baseline_is_set_by_organiser_and_not_entered_in_tournaments() {
    let site = Site::start().await;
    let [alpha, reference, _] = three_teams(&site).await;
    let mark = json!({ "baseline": true });
    change_team(&site, &reference, &reference.token, &mark)
        .await
        .problem(403, "forbidden", &[]);
    change_team(&site, &reference, ADMIN, &mark).await.json(200);
    let opened = site
        .post(
            "/api/v1/tournaments",
            Some(ADMIN),
            &json!({ "name": "Cup" }),
        )
        .await
        .json(201);
    let entrants = opened["entrants"].as_array().unwrap().iter();
    let names: Vec<_> = entrants
        .map(|entrant| string(&entrant["team_name"]))
        .collect();
    assert_eq!(names, ["Alpha", "Beta"]);
    // A signed-off result does not change any more.
    let stage = format!("/api/v1/stages/{}", site.stage().await);
    let closes = json!({ "closes_at": "2026-03-01T10:01:00Z" });
    site.patch(&stage, Some(ADMIN), &closes).await.json(200);
    site.advance(60);
    let name = string(&site.get(&stage, None).await.json(200)["name"]);
    site.post(
        &format!("{stage}/finalise"),
        Some(ADMIN),
        &json!({ "confirm": name }),
    )
    .await
    .json(200);
    for team in [&alpha, &reference] {
        let opposite = json!({ "baseline": team.id == alpha.id });
        change_team(&site, team, ADMIN, &opposite).await.problem(
            409,
            "conflict",
            &["signed off", "cannot be changed any more"],
        );
    }
}
