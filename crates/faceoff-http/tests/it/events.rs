//! Tests of the event log, which lists all changes of the season for organisers.

use crate::site::{ADMIN, Site, string};
use serde_json::{Value, json};

/// The kinds of a page's events.
fn kinds(page: &Value) -> Vec<String> {
    let events = page["events"].as_array().unwrap();
    events.iter().map(|event| string(&event["kind"])).collect()
}

/// A page of the log, as an organiser reads it.
async fn page(site: &Site, query: &str) -> Value {
    let path = format!("/api/v1/events{query}");
    site.get(&path, Some(ADMIN)).await.json(200)
}

#[tokio::test]
async fn events_are_filtered_by_actor_subject_and_kind() {
    let site = Site::start().await;
    let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
    site.valid_submission(&alpha, "a").await;
    let new_token = format!("/api/v1/teams/{}/token", beta.id);
    site.post(&new_token, Some(ADMIN), &json!({}))
        .await
        .json(200);
    site.start_day().await;

    let whole_log = page(&site, "").await;
    assert_eq!(whole_log["next_before"], json!(null));
    let found = kinds(&whole_log);
    assert_eq!(
        found.last().map(String::as_str),
        Some("token_created"),
        "the operator's token"
    );
    assert_eq!(found[found.len() - 2], "season_named");
    for kind in ["submission_uploaded", "token_replaced", "day_started"] {
        assert_eq!(found.iter().filter(|found| *found == kind).count(), 1);
    }
    // By actor, by subject, by kind.
    assert_eq!(
        kinds(&page(&site, &format!("?actor=team:{}", alpha.id)).await),
        ["submission_uploaded"]
    );
    assert_eq!(
        kinds(&page(&site, "?actor=team").await),
        ["submission_uploaded"]
    );
    let beta_events = page(&site, &format!("?subject=team:{}", beta.id)).await;
    assert_eq!(
        kinds(&beta_events),
        [
            "token_replaced",
            "token_created",
            "token_created",
            "team_created"
        ]
    );
    let created = &beta_events["events"][3];
    assert_eq!(created["actor"], "organiser");
    assert_eq!(created["details"], json!({ "name": "Beta" }));
    assert_eq!(created["subject"], format!("team:{}", beta.id));
    let by_schedule = format!("?subject=team:{}&actor=schedule", beta.id);
    assert_eq!(kinds(&page(&site, &by_schedule).await), [""; 0]);
    assert_eq!(
        kinds(&page(&site, "?kind=team_created&limit=1").await),
        ["team_created"]
    );

    // Paging returns the same events.
    let (mut paged, mut query) = (Vec::new(), "?limit=2".to_owned());
    loop {
        let page = page(&site, &query).await;
        assert!(kinds(&page).len() <= 2);
        paged.extend(page["events"].as_array().unwrap().clone());
        match page["next_before"].as_i64() {
            Some(before) => query = format!("?limit=2&before={before}"),
            None => break,
        }
    }
    assert_eq!(json!(paged), whole_log["events"]);
}

#[tokio::test]
async fn event_log_is_for_organisers_and_filters_are_validated() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let path = "/api/v1/events";
    site.get(path, None)
        .await
        .problem(401, "unauthenticated", &["token"]);
    site.get(path, Some(&team.token))
        .await
        .problem(403, "forbidden", &["organiser"]);
    for (query, words) in [
        ("limit=0", ["limit", "1 to 1000"]),
        ("limit=1001", ["limit", "1 to 1000"]),
        ("actor=robot", ["actor", "schedule"]),
        ("actor=team:none", ["actor", "team:ID"]),
        ("subject=team", ["subject", "team:ID"]),
        ("kind=day_start", ["kind", "day_started"]),
    ] {
        site.get(&format!("{path}?{query}"), Some(ADMIN))
            .await
            .problem(422, "invalid-content", &words);
    }
}
