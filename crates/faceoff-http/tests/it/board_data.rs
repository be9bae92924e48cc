//! Tests of boards (the rankings of a stage) as API clients read them: CSV, ETags, past days and the history.

use crate::site::{ADMIN, Answer, DATASET, LEASE_S, Site, TestTeam, result, string};
use reqwest::Method;
use serde_json::{Value, json};
use std::{collections::BTreeMap, io::Read};

/// Two teams with results on three days. The second team's agent name looks like a spreadsheet formula.
async fn three_days(site: &Site) -> [TestTeam; 2] {
    let teams = [site.team("Alpha").await, site.team("Beta").await];
    site.valid_submission(&teams[0], "plain").await;
    site.valid_submission(&teams[1], "=HYPERLINK(\"http://x\", 1),\n")
        .await;
    // Success rates of Alpha and Beta on each day.
    let daily_rates = [[0.5, 0.4], [0.6, 0.9], [0.7, 0.3]];
    for (index, rates) in daily_rates.iter().enumerate() {
        if index > 0 {
            site.next_day();
        }
        site.run_day_with_rates(rates).await;
    }
    teams
}

/// The rows of a CSV response, by column name.
fn csv_rows(answer: &Answer) -> Vec<BTreeMap<String, String>> {
    assert_eq!(answer.status, 200, "{}", answer.body);
    assert!(answer.header("content-type").starts_with("text/csv"));
    csv::Reader::from_reader(answer.body.as_bytes())
        .deserialize()
        .collect::<Result<_, _>>()
        .unwrap()
}

async fn get_with_headers(
    site: &Site,
    path: &str,
    headers: &[(&str, &str)],
    token: Option<&str>,
) -> Answer {
    let mut request = site.request(Method::GET, path, token);
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    Answer::read(request.send().await.unwrap()).await
}

/// Name and rank of each team on a board.
fn ranked_teams(board: &Value) -> Vec<(String, u64)> {
    let rows = board["rows"].as_array().unwrap().iter();
    rows.map(|row| (string(&row["team"]), row["rank"].as_u64().unwrap()))
        .collect()
}

#[tokio::test]
async fn board_csv_matches_the_json() {
    let site = Site::start().await;
    three_days(&site).await;
    let board = site.get("/api/v1/board", None).await.json(200);
    let lines = csv_rows(&site.get("/api/v1/board?format=csv", None).await);
    let accept = [("accept", "text/csv;q=0.9, text/plain")];
    let by_header = csv_rows(&get_with_headers(&site, "/api/v1/board", &accept, None).await);
    assert_eq!(lines, by_header);
    assert_eq!(lines.len(), 2);
    for (line, row) in lines.iter().zip(board["rows"].as_array().unwrap()) {
        let hit = &row["tasks"]["hit"];
        for (column, value) in [
            ("rank", &row["rank"]),
            ("rank_group", &row["rank_group"]),
            ("team", &row["team"]),
            ("team_id", &row["team_id"]),
            ("tier", &row["tier"]),
            ("score", &row["score"]),
            ("penalty_points", &row["penalty_points"]),
            ("day", &row["day"]),
            ("evaluation", &row["evaluation"]),
            ("seed", &row["seed"]),
            ("hit_success_rate", &hit["success_rate"]),
            ("hit_ci95_low", &hit["success_ci95"][0]),
            ("hit_violations_ee", &hit["violations"]["ee"]),
            (
                "hit_computation_time_p99_s",
                &hit["computation_time_s"]["p99"],
            ),
        ] {
            let expected = match value {
                Value::String(text) => text.clone(),
                Value::Number(number) => {
                    let parsed: f64 = line[column].parse().unwrap();
                    assert_eq!(Some(parsed), number.as_f64(), "{column}");
                    continue;
                }
                other => panic!("{column}: {other}"),
            };
            assert_eq!(line[column], expected, "{column}");
        }
        assert_eq!(line["baseline"], "false");
    }
    // The agent name is escaped, so that spreadsheets do not evaluate it as a formula.
    let agent = &lines.iter().find(|line| line["team"] == "Beta").unwrap()["agent"];
    assert!(
        agent.starts_with("'=HYPERLINK(\"http://x\", 1),"),
        "{agent:?}"
    );
    let json = [("accept", "text/csv, application/json")];
    get_with_headers(&site, "/api/v1/board", &json, None)
        .await
        .json(200);
    let task_lines = csv_rows(&site.get("/api/v1/board/hit?format=csv", None).await);
    assert_eq!(task_lines.len(), 2);
    site.get("/api/v1/board?format=xml", None)
        .await
        .problem(400, "invalid-request", &["format"]);
}

#[tokio::test]
async fn unchanged_board_answers_not_modified() {
    let site = Site::start().await;
    let [alpha, _] = three_days(&site).await;
    for path in [
        "/api/v1/board",
        "/api/v1/board/hit?format=csv",
        "/api/v1/board/history",
    ] {
        let first = site.get(path, None).await;
        let tag = first.header("etag").to_owned();
        assert!(tag.starts_with("W/\"board-"), "{tag}");
        assert_eq!(first.header("cache-control"), "private, no-cache");
        assert_eq!(first.header("vary"), "authorization, cookie, accept");
        let condition = [("if-none-match", tag.as_str())];
        let again = get_with_headers(&site, path, &condition, None).await;
        assert_eq!((again.status.as_u16(), again.body.as_str()), (304, ""));
        assert_eq!(again.header("etag"), tag);
        assert_eq!(again.header("vary"), "authorization, cookie, accept");
        // A team sees the same board, an organiser may see another one.
        let team = get_with_headers(&site, path, &condition, Some(&alpha.token)).await;
        assert_eq!(team.status, 304);
        let organiser = get_with_headers(&site, path, &condition, Some(ADMIN)).await;
        assert_eq!(organiser.status, 200);
        let other_query = format!(
            "{path}{}revision=1",
            if path.contains('?') { "&" } else { "?" }
        );
        let answer = get_with_headers(&site, &other_query, &condition, None).await;
        assert_eq!(answer.status, 200);
        let head = site.request(Method::HEAD, path, None).send().await.unwrap();
        assert_eq!(head.headers()["etag"], tag.as_str());
        assert_eq!(
            head.headers()["content-length"],
            first.header("content-length")
        );
    }
    // Progress without a result does not change the board.
    site.next_day();
    site.start_day().await;
    let (claim, ..) = site.claim_shard().await;
    let before = site.get("/api/v1/board", None).await;
    let condition = [("if-none-match", before.header("etag"))];
    let episodes_done = 3;
    let progress = site
        .store
        .heartbeat(&claim, episodes_done, LEASE_S, site.now());
    assert!(progress.await.unwrap());
    site.store.release(&claim, site.now()).await.unwrap();
    let again = get_with_headers(&site, "/api/v1/board", &condition, None).await;
    assert_eq!(again.status, 304);
    site.finish_evaluation(&result([0.8; 3], 10.0)).await;
    let changed = get_with_headers(&site, "/api/v1/board", &condition, None)
        .await
        .json(200);
    let score = changed["rows"][0]["score"].as_f64().unwrap();
    assert_eq!(score.round(), 80.0);
}

#[tokio::test]
async fn board_of_a_past_day_shows_results_up_to_that_day() {
    let site = Site::start().await;
    three_days(&site).await;
    let row = |name: &str, rank| (name.to_owned(), rank);
    for (query, first, second) in [
        ("?day=2026-03-01", "Alpha", "Beta"),
        ("?day=2026-03-02", "Beta", "Alpha"),
        ("?day=2026-03-03", "Alpha", "Beta"),
        ("?by=best", "Beta", "Alpha"),
        ("?by=best&day=2026-03-01", "Alpha", "Beta"),
        ("?by=latest", "Alpha", "Beta"),
    ] {
        let board = site.get(&format!("/api/v1/board{query}"), None).await;
        let board = board.json(200);
        assert_eq!(
            ranked_teams(&board),
            [row(first, 1), row(second, 2)],
            "{query}"
        );
        let expected = if query.contains("best") {
            "best"
        } else {
            "latest"
        };
        assert_eq!(board["rows_by"], expected);
        assert_eq!(board["standings"], "latest");
        let day = query.split("day=").nth(1);
        assert_eq!(board["day"].as_str(), day);
    }
    for (day, words) in [
        ("2026-02-28", "no earlier day"),
        (
            "2026-03-04",
            "the last earlier day with results is 2026-03-03",
        ),
    ] {
        site.get(&format!("/api/v1/board?day={day}"), None)
            .await
            .problem(404, "not-found", &[day, words]);
    }
    let page = site.get("/?day=2026-03-02", None).await;
    assert!(page.body.contains("up to 2026-03-02"), "{}", page.body);
}

#[tokio::test]
async fn history_lists_results_and_ranks_of_each_day() {
    let site = Site::start().await;
    three_days(&site).await;
    let summary = |history: &Value| -> Vec<(String, String, u64, f64)> {
        let rows = history["rows"].as_array().unwrap().iter();
        rows.map(|row| {
            let rank = row["rank"].as_u64().unwrap();
            let score = row["score"].as_f64().unwrap().round();
            (string(&row["day"]), string(&row["team"]), rank, score)
        })
        .collect()
    };
    let row = |day: &str, team: &str, rank, score| {
        (format!("2026-03-{day}"), team.to_owned(), rank, score)
    };
    let history = site.get("/api/v1/board/history", None).await.json(200);
    assert_eq!(
        summary(&history),
        [
            row("01", "Alpha", 1, 50.0),
            row("01", "Beta", 2, 40.0),
            row("02", "Beta", 1, 90.0),
            row("02", "Alpha", 2, 60.0),
            row("03", "Alpha", 1, 70.0),
            row("03", "Beta", 2, 30.0),
        ]
    );
    assert_eq!(
        history["days"],
        json!(["2026-03-01", "2026-03-02", "2026-03-03"])
    );
    assert_eq!(history["rows"][0]["tasks"]["hit"]["success_rate"], 0.5);
    // With `by=best` the last day changes no rank.
    let best = site
        .get("/api/v1/board/history?by=best&task=hit", None)
        .await;
    let best = summary(&best.json(200));
    assert_eq!(
        best[4..],
        [row("03", "Beta", 1, 30.0), row("03", "Alpha", 2, 70.0)]
    );
    let lines = csv_rows(&site.get("/api/v1/board/history?format=csv", None).await);
    assert_eq!(lines.len(), 6);
    assert_eq!(
        (
            lines[2]["day"].as_str(),
            lines[2]["team"].as_str(),
            lines[2]["rank"].as_str()
        ),
        ("2026-03-02", "Beta", "1")
    );
    assert_eq!(lines[2]["prepare_success_rate"], "0.9");
}

#[tokio::test]
async fn past_days_and_history_hide_results_after_a_freeze() {
    let site = Site::start().await;
    three_days(&site).await;
    let stage = format!("/api/v1/stages/{}", site.stage().await);
    let reason = json!({ "reason": "a surprise" });
    site.post(&format!("{stage}/freeze"), Some(ADMIN), &reason)
        .await
        .json(200);
    site.next_day();
    site.run_day_with_rates(&[0.1, 0.2]).await;
    let history = "/api/v1/board/history";
    for token in [None, Some(ADMIN)] {
        let view = site.get(history, token).await.json(200);
        assert_eq!(view["days"].as_array().unwrap().len(), 3);
        assert_eq!(view["frozen"]["reason"], "a surprise");
    }
    let live = format!("{history}?live=true");
    site.get(&live, None)
        .await
        .problem(401, "unauthenticated", &[]);
    let live = site.get(&live, Some(ADMIN)).await.json(200);
    assert_eq!(live["days"].as_array().unwrap().len(), 4);
    let hidden_day = "/api/v1/board?day=2026-03-04";
    site.get(hidden_day, None)
        .await
        .problem(404, "not-found", &["2026-03-03"]);
    let live = site
        .get(&format!("{hidden_day}&live=true"), Some(ADMIN))
        .await
        .json(200);
    assert_eq!(ranked_teams(&live)[0].0, "Beta");
}

#[tokio::test]
async fn texts_are_compressed_on_request_and_files_are_not() {
    let site = Site::start().await;
    let [alpha, _] = three_days(&site).await;
    let plain = site.get("/api/v1/board", None).await;
    assert!(!plain.headers.contains_key("content-encoding"));
    let get_gzip = async |path: &str| {
        let request = site.request(Method::GET, path, Some(&alpha.token));
        let sent = request
            .header("accept-encoding", "gzip")
            .send()
            .await
            .unwrap();
        let headers = sent.headers().clone();
        (headers, sent.bytes().await.unwrap())
    };
    let (headers, body) = get_gzip("/api/v1/board").await;
    assert_eq!(headers["content-encoding"], "gzip");
    let vary = headers
        .get_all("vary")
        .iter()
        .map(|value| value.to_str().unwrap());
    assert_eq!(
        vary.collect::<Vec<_>>().join(", "),
        "authorization, cookie, accept, accept-encoding"
    );
    assert!(body.len() < plain.body.len() / 2);
    let mut unpacked = String::new();
    let mut reader = flate2::read::GzDecoder::new(&body[..]);
    reader.read_to_string(&mut unpacked).unwrap();
    let [unpacked, plain]: [Value; 2] =
        [&unpacked, &plain.body].map(|text| serde_json::from_str(text).unwrap());
    assert_eq!(unpacked, plain);
    let list = site
        .get("/api/v1/evaluations", Some(&alpha.token))
        .await
        .json(200);
    let dataset = format!("/api/v1/evaluations/{}/dataset", string(&list[0]["id"]));
    let (headers, body) = get_gzip(&dataset).await;
    assert!(!headers.contains_key("content-encoding"));
    assert_eq!(&body[..], DATASET.as_bytes());
    let (headers, _) = get_gzip("/api/v1/whoami").await;
    assert!(
        !headers.contains_key("content-encoding"),
        "small responses are not compressed"
    );
}
