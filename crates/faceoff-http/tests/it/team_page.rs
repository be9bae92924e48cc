//! A team's page: its days, what they broke, and what it has uploaded.

use crate::{
    html::{page, texts},
    site::{ADMIN, Site, TestTeam, result},
};
use reqwest::Method;
use scraper::{Html, Selector};
use serde_json::json;

/// Two teams on three days; the first one's scores rise.
async fn three_days(site: &Site) -> [TestTeam; 2] {
    let teams = [site.team("Alpha").await, site.team("Beta").await];
    for team in &teams {
        site.valid_submission(team, "agent").await;
    }
    for (at, rate) in [0.5, 0.6, 0.7].into_iter().enumerate() {
        if at > 0 {
            site.next_day();
        }
        site.post("/api/v1/days", Some(ADMIN), &json!({}))
            .await
            .json(200);
        site.finish(&result([rate; 3], 700.0)).await;
        site.finish(&result([0.65; 3], 10.0)).await;
    }
    teams
}

fn attributes(html: &Html, selector: &str, name: &str) -> Vec<String> {
    html.select(&Selector::parse(selector).unwrap())
        .map(|element| element.value().attr(name).unwrap().to_owned())
        .collect()
}

#[tokio::test]
async fn a_team_sees_how_it_came_where_it_is() {
    let site = Site::start().await;
    let [alpha, beta] = three_days(&site).await;
    let html = page(&site, &format!("/teams/{}", alpha.id)).await;
    assert_eq!(texts(&html, "h1"), ["Alpha"]);
    // A better score in a worse tier stands below.
    let tiles = texts(&html, ".tiles").join(" ");
    for part in ["Rank by 2026-03-03", "▲ Improvable", "70.0 %", "700.0"] {
        assert!(tiles.contains(part), "{part:?} is not in {tiles:?}");
    }
    assert_eq!(texts(&html, ".tiles .figure")[0], "2");
    assert_eq!(
        texts(&html, ".panel figcaption strong"),
        ["Score", "Penalty points", "Hit", "Defend", "Prepare"]
    );
    for panel in 1..=5 {
        let dots = format!(".panel:nth-of-type({panel}) circle");
        assert_eq!(texts(&html, &dots).len(), 3, "a point for each day");
    }
    // 3 percentage points of each task to each side, which weigh 0.4, 0.4 and 0.2: 3 × 0.6.
    assert_eq!(
        texts(&html, ".panel:nth-of-type(1) circle title")[2],
        "2026-03-03: 70 (68.2 – 71.8)"
    );
    assert_eq!(
        texts(&html, ".panel:nth-of-type(2) text.bound"),
        ["deployable up to here"],
        "0.7 points an episode are far below the other bound"
    );
    assert_eq!(
        texts(&html, "details tbody th"),
        ["2026-03-03", "2026-03-02", "2026-03-01"]
    );
    let newest = texts(&html, "details tbody tr:first-child td");
    let told = [&newest[..3], &newest[6..]].concat();
    let expected = ["2", "▲ Improvable", "70.0 68.2 – 71.8", "700.0", "0.70"];
    assert_eq!(told, expected, "{newest:?}");
    // 7 episodes of 1000 of each task and day.
    let broken = "section[aria-labelledby=broken] tbody";
    assert_eq!(texts(&html, &format!("{broken} tr")).len(), 3);
    assert_eq!(
        texts(&html, &format!("{broken} tr:first-child td")),
        ["3000", "21 (1 %)", "0", "0", "0", "0"]
    );

    // From board to team to evaluation.
    let board = page(&site, "/").await;
    assert_eq!(
        attributes(&board, ".board th.team > a", "href"),
        [&beta, &alpha].map(|team| format!("/teams/{}", team.id))
    );
    let evaluation = &attributes(&html, "details tbody th a", "href")[0];
    let shown = page(&site, evaluation).await;
    assert!(texts(&shown, "h1")[0].contains("Alpha"));
    let csv = &attributes(&html, "a[href$=csv]", "href")[0];
    assert!(site.get(csv, None).await.body.contains("Alpha"));
}

#[tokio::test]
async fn what_was_not_played_is_for_the_team_and_organisers_alone() {
    let site = Site::start().await;
    let [alpha, beta] = three_days(&site).await;
    let path = format!("/teams/{}", alpha.id);
    let own = site.get(&path, Some(&alpha.token)).await.body;
    assert!(own.contains("plays at the next cut"), "{own}");
    assert!(
        site.get(&path, Some(ADMIN))
            .await
            .body
            .contains("plays at the next cut")
    );
    for token in [None, Some(beta.token.as_str())] {
        let theirs = site.get(&path, token).await;
        assert_eq!(theirs.status, 200);
        assert!(!theirs.body.contains("Submissions"), "{}", theirs.body);
    }
}

#[tokio::test]
async fn a_team_without_a_result_says_so_and_a_team_that_is_none_is_not_found() {
    let site = Site::start().await;
    let team = site.team("Gamma").await;
    let html = page(&site, &format!("/teams/{}", team.id)).await;
    assert_eq!(texts(&html, "h2"), ["No result yet in this stage"]);
    assert!(texts(&html, ".panel").is_empty());
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
async fn a_disqualified_team_keeps_its_page_with_the_reason() {
    let site = Site::start().await;
    let [alpha, _] = three_days(&site).await;
    let path = format!("/api/v1/teams/{}/disqualify", alpha.id);
    let body = json!({ "reason": "it looked elsewhere", "confirm": "Alpha" });
    let request = site.request(Method::POST, &path, Some(ADMIN)).json(&body);
    let answer = request.send().await.unwrap();
    assert!(
        answer.status().is_success(),
        "{}",
        answer.text().await.unwrap()
    );
    let html = page(&site, &format!("/teams/{}", alpha.id)).await;
    assert!(texts(&html, "[role=status]")[0].contains("it looked elsewhere"));
}
