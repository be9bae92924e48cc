//! Tests of boards, the rankings of a stage: the overall board and the task boards, in the API and on pages.

use crate::{
    html::{page, texts},
    site::{LEASE_S, Site, result},
};
use faceoff_scoring::{
    COMPUTATION_TIME_MAX_POINTS,
    tournament::{EE_POINTS, JOINT_POS_POINTS, JOINT_VEL_POINTS, LINK_POINTS},
};
use scraper::Selector;
use serde_json::json;

/// Five teams of the qualifying table in the paper on the 2023 Robot Air Hockey Challenge, not in board order: name, success rates (hit,
/// defend, prepare) and penalty points.
const TEAMS: [(&str, [f64; 3], f64); 5] = [
    ("RL3_polimi", [0.227, 0.616, 0.362], 920.0),
    ("Kalash Jain", [0.0, 0.195, 0.083], 0.0),
    ("Reckless", [0.9, 0.9, 0.9], 1500.5),
    ("AiRLIHockey", [0.549, 0.845, 0.903], 327.5),
    ("AeroTron", [0.332, 0.232, 0.665], 594.0),
];

async fn site_with_results() -> Site {
    let site = Site::start().await;
    let teams = TEAMS.map(|(name, rates, points)| (name, result(rates, points)));
    site.add_ranked_teams(&teams).await;
    site
}

/// Tier and name of the teams in the order of the board.
const BOARD_ORDER: [(&str, &str); 5] = [
    ("deployable", "AiRLIHockey"),
    ("deployable", "Kalash Jain"),
    ("improvable", "RL3_polimi"),
    ("improvable", "AeroTron"),
    ("non_deployable", "Reckless"),
];

#[tokio::test]
async fn board_shows_tiers_rates_intervals_points_and_scores() {
    let site = site_with_results().await;
    let html = page(&site, "/").await;
    assert_eq!(
        texts(&html, "tbody[data-tier] .group .tier"),
        ["✓ Deployable", "▲ Improvable", "✕ Non-deployable"]
    );
    let names: Vec<_> = BOARD_ORDER.iter().map(|(_, name)| *name).collect();
    assert_eq!(texts(&html, ".board th.team > a"), names);
    assert_eq!(
        texts(&html, ".board td.rank"),
        ["1=", "1=", "3=", "3=", "5"]
    );
    for (tier, name) in BOARD_ORDER {
        let rows = texts(&html, &format!("tbody[data-tier={tier}] th.team > a"));
        assert!(
            rows.contains(&name.to_owned()),
            "{name} is not among {tier}: {rows:?}"
        );
    }
    let first = &texts(&html, ".board tbody tr:not(.group)")[0];
    for part in [
        "54.9 %",
        "95 % interval 51.9 – 57.9",
        "84.5 %",
        "90.3 %",
        "327.5",
        "0.33 per episode",
        "73.8",
        "AiRLIHockey-agent",
        "2026-03-01",
    ] {
        assert!(first.contains(part), "{part:?} is not in {first:?}");
    }
    let caption = &texts(&html, ".board caption")[0];
    let setting =
        "perturbations of the profile “evaluation”, 1000 episodes per task, rules airhockey-2023.3";
    assert!(caption.contains(setting), "{caption}");
    let commitment = site.store.season().await.unwrap().commitment;
    let legend = texts(&html, ".legend, .board ~ .note").join(" ");
    for part in [commitment.as_str(), "Wilson", "0.4 × hit", "at most 0.5,"] {
        assert!(legend.contains(part), "{part:?} is not in the legend");
    }
    for rule in [
        format!("end effector out of bounds {EE_POINTS}"),
        format!("elbow or wrist too low {LINK_POINTS}"),
        format!("joint position {JOINT_POS_POINTS}"),
        format!("joint velocity {JOINT_VEL_POINTS}"),
        format!("late answers 0.5 to {COMPUTATION_TIME_MAX_POINTS}"),
    ] {
        assert!(legend.contains(&rule), "{rule:?} is not in the legend");
    }
    assert!(texts(&html, "footer")[0].contains("airhockey-2023.3"));
    assert!(texts(&html, ".lead")[0].contains("Test season"));
    // Screen readers need a caption and scoped headers.
    assert_eq!(texts(&html, "table.board caption").len(), 1);
    let unscoped = Selector::parse("table th:not([scope])").unwrap();
    assert_eq!(html.select(&unscoped).count(), 0);
}

#[tokio::test]
async fn board_shows_only_score_and_points_before_the_release() {
    let site = Site::start().await;
    for (name, ..) in TEAMS {
        let team = site.team(name).await;
        site.valid_submission(&team, name).await;
    }
    let (_, _, late_evaluation) = site.team_with_evaluation("Late", "late").await;
    for (_, rates, points) in TEAMS {
        site.finish_evaluation(&result(rates, points)).await;
    }
    let seed = result([0.0; 3], 0.0).seed.to_string();
    let details = ["violations", "steps", "computation_time_s"];
    for path in ["/api/v1/board", "/api/v1/board/hit"] {
        let board = site.get(path, None).await.json(200);
        let rows = board["rows"].as_array().unwrap();
        assert_eq!(rows.len(), TEAMS.len());
        for row in rows {
            assert_eq!(
                (&row["seed"], &row["released_at"]),
                (&json!(null), &json!(null))
            );
            let hit = &row["tasks"]["hit"];
            assert_eq!(hit["success_ci95"].as_array().unwrap().len(), 2);
            for detail in details {
                assert_eq!(hit[detail], json!(null), "{detail}");
            }
        }
    }
    let board = site.get("/api/v1/board", None).await.json(200);
    for (row, (tier, name)) in board["rows"].as_array().unwrap().iter().zip(BOARD_ORDER) {
        assert_eq!((&row["tier"], &row["team"]), (&json!(tier), &json!(name)));
    }
    assert_eq!(board["rows"].as_array().unwrap().len(), BOARD_ORDER.len());
    assert_eq!(board["ruleset"], "airhockey-2023.3");
    let stage = site.stage().await;
    assert_eq!(
        (&board["stage"], &board["stage_name"], &board["revision"]),
        (&json!(stage), &json!("Qualifying"), &json!(1))
    );
    let path_with_stage = format!("/api/v1/board?stage={stage}&revision=1");
    assert_eq!(site.get(&path_with_stage, None).await.json(200), board);
    site.get("/api/v1/board?revision=2", None)
        .await
        .problem(404, "not-found", &["revision"]);
    site.get("/api/v1/board/hit?stage=chess", None)
        .await
        .problem(400, "invalid-request", &["stage"]);
    let evaluation = format!(
        "/evaluations/{}",
        board["rows"][0]["evaluation"].as_str().unwrap()
    );
    let html = page(&site, &evaluation).await;
    assert_eq!(
        texts(&html, "table caption").len(),
        1,
        "no violations, no times"
    );
    assert!(
        texts(&html, ".facts")
            .join(" ")
            .contains("published when the day is released")
    );
    let tasks = page(&site, "/tasks/hit").await;
    assert_eq!(texts(&tasks, "td.none").len(), TEAMS.len());
    assert!(!site.get(&evaluation, None).await.body.contains(&seed));

    // Once the last evaluation ends, the day is released: all details become public.
    site.finish_evaluation(&result([0.1, 0.1, 0.1], 10.0)).await;
    let board = site.get("/api/v1/board", None).await.json(200);
    assert_eq!(board["rows"][0]["seed"], seed);
    assert_eq!(board["rows"][0]["tasks"]["hit"]["violations"]["ee"], 7);
    for path in [evaluation, late_evaluation.replace("/api/v1", "")] {
        assert!(site.get(&path, None).await.body.contains(&seed));
    }
    assert_eq!(texts(&page(&site, "/tasks/hit").await, "td.none").len(), 0);
}

#[tokio::test]
async fn task_board_ranks_by_its_task_only() {
    let site = site_with_results().await;
    let board = site.get("/api/v1/board/prepare", None).await.json(200);
    let names: Vec<_> = board["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["team"].clone())
        .collect();
    assert_eq!(
        names,
        [
            "AiRLIHockey",
            "Reckless",
            "AeroTron",
            "RL3_polimi",
            "Kalash Jain"
        ]
    );
    assert_eq!(board["task"], "prepare");
    site.get("/api/v1/board/juggle", None)
        .await
        .problem(404, "not-found", &["juggle", "prepare"]);

    let html = page(&site, "/tasks/prepare").await;
    assert_eq!(
        texts(&html, ".board th.team > a"),
        [
            "AiRLIHockey",
            "Reckless",
            "AeroTron",
            "RL3_polimi",
            "Kalash Jain"
        ]
    );
    assert_eq!(
        texts(&html, "tbody[data-tier]").len(),
        1,
        "no team has points in this task"
    );
    assert_eq!(texts(&html, ".tabs [aria-current=page]"), ["Prepare"]);
    assert_eq!(texts(&html, "header [aria-current=true]"), ["Board"]);
}

#[tokio::test]
async fn evaluation_page_shows_results_violations_and_times() {
    let site = site_with_results().await;
    let board = site.get("/api/v1/board", None).await.json(200);
    let path = format!(
        "/evaluations/{}",
        board["rows"][0]["evaluation"].as_str().unwrap()
    );
    let html = page(&site, &path).await;
    assert_eq!(texts(&html, "h1"), ["AiRLIHockey"]);
    assert_eq!(texts(&html, "table caption").len(), 4);
    let tables = texts(&html, "table").join(" ");
    // Success rate, violations, two computation times in ms, and steps, as `site::result` sets them.
    for part in ["54.9 %", "7 (1 %)", "0.90", "12", "123456"] {
        assert!(tables.contains(part), "{part:?} is not in {tables:?}");
    }
    for part in [
        // Cells of a row follow each other without a space: count, median, p99 and maximum in ms.
        "before the evaluation2000.0210.0830.420",
        "between episodes30000.0220.09531.200",
    ] {
        assert!(tables.contains(part), "{part:?} is not in {tables:?}");
    }
    let facts = texts(&html, ".facts").join(" ");
    for part in [
        "Longest delay caused by the server’s machine30 ms",
        "Episodes repeated because of it2",
        "Restarts after a platform fault1",
    ] {
        assert!(facts.contains(part), "{part:?} is not in {facts:?}");
    }
}

#[tokio::test]
async fn board_page_shows_next_steps_and_progress() {
    let site = Site::start().await;
    let html = page(&site, "/").await;
    let empty = texts(&html, ".empty").join(" ");
    for part in [
        "faceoff admin people invite-team",
        "faceoff submit",
        "faceoff admin start-day",
    ] {
        assert!(empty.contains(part), "{part:?} is not in {empty:?}");
    }
    page(&site, "/tasks/hit").await;

    let (_, _, evaluation) = site.team_with_evaluation("Alpha", "striker").await;
    let (claim, ..) = site.claim_shard().await;
    let episodes_done = 3;
    site.store
        .heartbeat(&claim, episodes_done, LEASE_S, site.now())
        .await
        .unwrap();
    for day in ["today", "after midnight"] {
        let html = page(&site, "/").await;
        let rows = texts(&html, ".under-way .evaluation-list li");
        // No shard is complete.
        assert_eq!(rows, ["Alpha Running 0 of 12"], "{day}");
        let total = texts(&html, ".under-way .total-progress").join(" ");
        assert!(
            total.starts_with("In progress: 0 of 1 evaluations done 0 of 12 episodes"),
            "{total}"
        );
        site.next_day();
    }
    let html = page(&site, &evaluation.replace("/api/v1", "")).await;
    assert!(texts(&html, ".card").join(" ").contains("0 of 12 episodes"));
}
