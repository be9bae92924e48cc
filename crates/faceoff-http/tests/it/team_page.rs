//! Tests of a team's page: its results day by day, its violations, and its submissions.

use crate::{
    html::{attributes, page, texts},
    site::{ADMIN, Site, TestTeam, result},
};
use reqwest::Method;
use serde_json::json;

/// Two teams on three days. The first team's scores rise.
async fn three_days(site: &Site) -> [TestTeam; 2] {
    let teams = [site.team("Alpha").await, site.team("Beta").await];
    for team in &teams {
        site.valid_submission(team, "agent").await;
    }
    for (index, rate) in [0.5, 0.6, 0.7].into_iter().enumerate() {
        if index > 0 {
            site.next_day();
        }
        site.start_day().await;
        site.finish_evaluation(&result([rate; 3], 700.0)).await;
        site.finish_evaluation(&result([0.65; 3], 10.0)).await;
    }
    teams
}

#[tokio::test]
async fn team_page_shows_rank_history_and_violations() {
    let site = Site::start().await;
    let [alpha, beta] = three_days(&site).await;
    let html = page(&site, &format!("/teams/{}", alpha.id)).await;
    assert_eq!(texts(&html, "h1"), ["Alpha"]);
    // A better score in a worse tier has a lower rank.
    let tiles = texts(&html, ".tiles").join(" ");
    for part in ["Rank on 2026-03-03", "▲ Improvable", "70.0 %", "700.0"] {
        assert!(tiles.contains(part), "{part:?} is not in {tiles:?}");
    }
    assert_eq!(texts(&html, ".tiles .figure")[0], "2");
    assert_eq!(
        texts(&html, ".chart figcaption strong"),
        ["Score", "Penalty points", "Hit", "Defend", "Prepare"]
    );
    for panel in 1..=5 {
        let dots = format!(".chart:nth-of-type({panel}) circle");
        assert_eq!(texts(&html, &dots).len(), 3, "one point for each day");
    }
    // The interval of each task has 3 percentage points to each side. With the weights 0.4, 0.4 and 0.2, that of the score has
    // 3 × √(0.4² + 0.4² + 0.2²) = 1.8.
    assert_eq!(
        texts(&html, ".chart:nth-of-type(1) circle title")[2],
        "2026-03-03: 70 (68.2 – 71.8)"
    );
    assert_eq!(
        texts(&html, ".chart:nth-of-type(2) text.bound"),
        ["limit of deployable"],
        "0.7 points an episode are far below the other bound"
    );
    assert_eq!(
        texts(&html, "details tbody th"),
        ["2026-03-03", "2026-03-02", "2026-03-01"]
    );
    let newest = texts(&html, "details tbody tr:first-child td");
    // All cells except those of the three tasks.
    let overall_cells = [&newest[..3], &newest[6..]].concat();
    let expected = ["2", "▲ Improvable", "70.0 68.2 – 71.8", "700.0", "0.70"];
    assert_eq!(overall_cells, expected, "{newest:?}");
    // The end effector left its bounds in 7 of 1000 episodes of each task on each day.
    let violations = "section[aria-labelledby=violations] tbody";
    assert_eq!(texts(&html, &format!("{violations} tr")).len(), 3);
    assert_eq!(
        texts(&html, &format!("{violations} tr:first-child td")),
        ["3000", "21 (1 %)", "0", "0", "0", "0"]
    );

    // The board links to the team's page, and this page to the evaluations.
    let board = page(&site, "/").await;
    assert_eq!(
        attributes(&board, ".board th.team > a", "href"),
        [&beta, &alpha].map(|team| format!("/teams/{}", team.id))
    );
    let evaluation = &attributes(&html, "details tbody th a", "href")[0];
    let evaluation_page = page(&site, evaluation).await;
    assert!(texts(&evaluation_page, "h1")[0].contains("Alpha"));
    let csv = &attributes(&html, "a[href$=csv]", "href")[0];
    assert!(site.get(csv, None).await.body.contains("Alpha"));
}

#[tokio::test]
async fn submissions_are_shown_to_the_team_and_organisers_only() {
    let site = Site::start().await;
    let [alpha, beta] = three_days(&site).await;
    let path = format!("/teams/{}", alpha.id);
    let team_view = site.get(&path, Some(&alpha.token)).await.body;
    assert!(
        team_view.contains("active at the next cutoff"),
        "{team_view}"
    );
    assert!(
        site.get(&path, Some(ADMIN))
            .await
            .body
            .contains("active at the next cutoff")
    );
    for token in [None, Some(beta.token.as_str())] {
        let answer = site.get(&path, token).await;
        assert_eq!(answer.status, 200);
        assert!(!answer.body.contains("Submissions"), "{}", answer.body);
    }
}

#[tokio::test]
async fn team_without_result_has_no_chart_and_unknown_is_404() {
    let site = Site::start().await;
    let team = site.team("Gamma").await;
    let html = page(&site, &format!("/teams/{}", team.id)).await;
    assert_eq!(texts(&html, "h2"), ["No result yet in this stage"]);
    assert!(texts(&html, ".chart").is_empty());
    for (path, status) in [
        (
            "/teams/00000000-0000-7000-8000-000000000000".to_owned(),
            404,
        ),
        ("/teams/Gamma".to_owned(), 404),
        (format!("/teams/{}?stage=none", team.id), 400),
        (format!("/teams/{}?day=2026-03-01", team.id), 400),
    ] {
        let answer = site.get(&path, None).await;
        assert_eq!(answer.status, status, "{path}: {}", answer.body);
        assert!(answer.body.contains("<h1"), "a page, not JSON");
    }
}

#[tokio::test]
async fn disqualified_team_page_shows_the_reason() {
    let site = Site::start().await;
    let [alpha, _] = three_days(&site).await;
    let path = format!("/api/v1/teams/{}/disqualify", alpha.id);
    let body = json!({ "reason": "it read the seed", "confirm": "Alpha" });
    let request = site.request(Method::POST, &path, Some(ADMIN)).json(&body);
    let answer = request.send().await.unwrap();
    assert!(
        answer.status().is_success(),
        "{}",
        answer.text().await.unwrap()
    );
    let html = page(&site, &format!("/teams/{}", alpha.id)).await;
    assert!(texts(&html, "[role=status]")[0].contains("it read the seed"));
}
