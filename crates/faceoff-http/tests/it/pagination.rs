//! Tests of paginated lists: each page links to the next, and no row is skipped or repeated while rows are added.

use crate::{
    site::{ADMIN, Answer, Site, TestTeam, string},
    tournament::cup::TestTournament,
    users::organiser,
};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// The path of the next page, from the `Link` header.
fn next_page(answer: &Answer) -> Option<String> {
    let link = answer.headers.get("link")?.to_str().unwrap();
    let (path, rel) = link.strip_prefix('<').unwrap().split_once('>').unwrap();
    assert_eq!(rel, "; rel=\"next\"");
    Some(path.to_owned())
}

/// The values of a field on all pages. Between two pages it calls `between_pages` with the number of the page that was read.
async fn collect_pages(
    site: &Site,
    path: &str,
    token: Option<&str>,
    field: &str,
    between_pages: impl AsyncFn(usize),
) -> Vec<String> {
    let mut found = Vec::new();
    let mut path = path.to_owned();
    for page in 0.. {
        let answer = site.get(&path, token).await;
        let body = answer.json(200);
        let rows = body.as_array().unwrap();
        found.extend(rows.iter().map(|row| string(&row[field])));
        match next_page(&answer) {
            Some(next) => path = next,
            None => break,
        }
        between_pages(page).await;
    }
    found
}

/// For lists that do not change between two pages.
async fn no_change(_: usize) {}

#[tokio::test]
async fn pages_list_each_row_once_while_rows_are_added() {
    let site = Site::start().await;
    let names = ["Delta", "Beta", "Epsilon", "Gamma", "Alpha"];
    for name in names {
        site.team(name).await;
    }
    let add_two_teams = async |page: usize| {
        // One name sorts before the rows that were read, one after them.
        site.team(&format!("A before {page}")).await;
        site.team(&format!("Zeta {page}")).await;
    };
    let path = "/api/v1/teams?limit=2";
    let found = collect_pages(&site, path, Some(ADMIN), "name", add_two_teams).await;
    let distinct: BTreeSet<&String> = found.iter().collect();
    assert_eq!(distinct.len(), found.len(), "{found:?}");
    for name in names {
        assert!(
            found.iter().any(|listed| listed == name),
            "{name}: {found:?}"
        );
    }
}

#[tokio::test]
async fn submissions_and_evaluations_are_listed_newest_first() {
    let site = Site::start().await;
    let [alpha, beta]: [TestTeam; 2] = [site.team("Alpha").await, site.team("Beta").await];
    let mut uploaded = Vec::new();
    // The clock stands still, so all submissions have the same time stamp. Their ids decide the order.
    for _ in 0..5 {
        let path = site.valid_submission(&alpha, "a").await;
        uploaded.push(path.rsplit('/').next().unwrap().to_owned());
    }
    site.valid_submission(&beta, "b").await;
    uploaded.reverse();
    let alpha_token = Some(alpha.token.as_str());
    // Newer rows are before those that were read, so they are not listed.
    let add_submission = async |_| {
        site.valid_submission(&alpha, "a").await;
    };
    let path = "/api/v1/submissions?limit=2";
    assert_eq!(
        collect_pages(&site, path, alpha_token, "id", add_submission).await,
        uploaded
    );

    for _ in 0..5 {
        site.run_day_with_rates(&[0.5; 2]).await;
        site.next_day();
    }
    let on_one_page = site.get("/api/v1/evaluations", alpha_token).await;
    assert_eq!(next_page(&on_one_page), None);
    let listed: Vec<String> = on_one_page
        .json(200)
        .as_array()
        .unwrap()
        .iter()
        .map(|row| string(&row["id"]))
        .collect();
    assert_eq!(listed.len(), 5);
    let add_day = async |page| {
        if page == 0 {
            site.run_day_with_rates(&[0.5; 2]).await;
        }
    };
    let path = "/api/v1/evaluations?limit=2";
    assert_eq!(
        collect_pages(&site, path, alpha_token, "id", add_day).await,
        listed
    );
    // The link to the next page keeps the other parameters.
    let filtered = "/api/v1/evaluations?day=2026-03-02&limit=1";
    let alpha_days = collect_pages(&site, filtered, alpha_token, "day", no_change).await;
    assert_eq!(alpha_days, ["2026-03-02"]);
    let first = site.get(filtered, Some(ADMIN)).await;
    assert!(
        next_page(&first)
            .unwrap()
            .contains("day=2026-03-02&limit=1&after=")
    );
    let mut team_names = collect_pages(&site, filtered, Some(ADMIN), "team_name", no_change).await;
    team_names.sort();
    assert_eq!(team_names, ["Alpha", "Beta"]);
}

#[tokio::test]
async fn growing_lists_are_paginated() {
    let cup = TestTournament::open(&["A", "B", "C"], json!({})).await;
    let site = &cup.site;
    cup.start_round().await;
    for title in ["one", "two"] {
        let announcement = json!({ "title": title, "text": title });
        let announced = site
            .post("/api/v1/announcements", Some(ADMIN), &announcement)
            .await;
        announced.json(201);
        let question = json!({ "text": title });
        let asked = site
            .post("/api/v1/questions", Some(cup.token("A")), &question)
            .await;
        asked.json(201);
        organiser(site, title).await;
    }
    let tournament = cup.games().await[0]["tournament"].clone();
    let games = format!("/api/v1/tournaments/{}/games", string(&tournament));
    let lists = [
        "/api/v1/announcements",
        "/api/v1/questions",
        "/api/v1/invitations",
        "/api/v1/people",
        "/api/v1/tokens",
        "/api/v1/teams",
        &games,
    ];
    for list in lists {
        let single_page = site.get(list, Some(ADMIN)).await;
        assert_eq!(next_page(&single_page), None, "{list}");
        let rows: Vec<Value> = serde_json::from_str(&single_page.body).unwrap();
        let ids: Vec<String> = rows.iter().map(|row| string(&row["id"])).collect();
        assert!(ids.len() > 1, "{list}");
        let path = format!("{list}?limit=1");
        let collected = collect_pages(site, &path, Some(ADMIN), "id", no_change).await;
        assert_eq!(collected, ids, "{list}");
    }
    let all_lists = lists.into_iter().chain([
        "/api/v1/registrations",
        "/api/v1/proposals",
        "/api/v1/evaluations",
    ]);
    for list in all_lists {
        for limit in ["0", "201"] {
            let path = format!("{list}?limit={limit}");
            let refused = site.get(&path, Some(ADMIN)).await;
            refused.problem(422, "invalid-content", &["limit", "1 to 200"]);
        }
        for (after, words) in [
            ("nothing", "after"),
            ("00000000-0000-7000-8000-000000000000", "start again"),
        ] {
            let path = format!("{list}?after={after}");
            let refused = site.get(&path, Some(ADMIN)).await;
            refused.problem(400, "invalid-request", &[words]);
        }
    }
}
