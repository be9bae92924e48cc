//! Tests of the pages to join (by an invitation's link), register and sign in, with a browser without scripts.

use crate::{
    browser::{Browser, PASSWORD, first_text, invite},
    site::{ADMIN, Site, string},
};
use scraper::{Html, Selector};
use serde_json::json;

#[tokio::test]
async fn user_joins_by_link_signs_out_and_signs_in() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let link = invite(
        &site,
        json!({ "role": "member", "team": team.id, "note": "Ada" }),
    )
    .await;
    let mut browser = Browser::new(&site);
    let page = browser.open(&link).await;
    assert_eq!(
        (page.status.as_u16(), first_text(&page, "h1")),
        (200, "Join the team Alpha".into())
    );
    let short = [("name", "Ada"), ("password", "short")];
    let refused = browser.submit(&link, &short).await;
    assert_eq!(refused.status, 422);
    assert!(
        first_text(&refused, "[role=alert]").contains("12 or more"),
        "{}",
        refused.body
    );
    assert!(
        refused.body.contains("value=\"Ada\""),
        "the form keeps the name"
    );
    assert!(!refused.body.contains("value=\"short\""));
    let fields = [("name", "Ada"), ("password", PASSWORD)];
    let joined = browser.submit(&link, &fields).await;
    assert_eq!(
        (joined.status.as_u16(), joined.header("location")),
        (303, "/account")
    );
    let account = browser.open("/account").await;
    assert_eq!(first_text(&account, "h1"), "Ada");
    assert!(account.body.contains("Alpha"));
    assert!(
        !account.body.contains("/organiser"),
        "a member sees no organiser pages"
    );
    let used = browser.submit(&link, &fields).await;
    assert_eq!(used.status, 409);
    assert!(used.body.contains("was accepted"), "{}", used.body);

    let signed_out = browser.submit("/sign-out", &[]).await;
    assert_eq!(signed_out.header("location"), "/");
    assert_eq!(browser.cookie, None);
    assert_eq!(
        browser.open("/account").await.header("location"),
        "/sign-in"
    );
    let wrong = browser
        .submit("/sign-in", &[("name", "Ada"), ("password", "wrong")])
        .await;
    assert_eq!(wrong.status, 401);
    assert!(first_text(&wrong, "[role=alert]").contains("name or password"));
    let signed_in = browser
        .submit("/sign-in", &[("name", "ada"), ("password", PASSWORD)])
        .await;
    assert_eq!(signed_in.header("location"), "/account");
    assert_eq!(browser.open("/organiser/log").await.status, 403);
}

#[tokio::test]
async fn log_page_is_for_organisers_and_paginated() {
    let site = Site::start().await;
    let link = invite(&site, json!({ "role": "organiser", "note": "Grace" })).await;
    let mut browser = Browser::new(&site);
    assert_eq!(
        browser.open("/log").await.header("location"),
        "/organiser/log"
    );
    assert_eq!(
        browser.open("/organiser/log").await.header("location"),
        "/sign-in?next=%2Forganiser%2Flog"
    );
    browser
        .submit(&link, &[("name", "Grace"), ("password", PASSWORD)])
        .await;
    for name in ["Alpha", "Beta"] {
        site.team(name).await;
    }
    let log = browser
        .open("/organiser/log?actor=&subject=&kind=team_created")
        .await;
    assert_eq!(log.status, 200);
    let rows = Html::parse_document(&log.body);
    assert_eq!(
        rows.select(&Selector::parse("tbody tr").unwrap()).count(),
        2
    );
    let page = browser.open("/organiser/log?limit=1").await;
    let older = Html::parse_document(&page.body);
    let older = older
        .select(&Selector::parse("a[href^='/organiser/log?before=']").unwrap())
        .next();
    let older = older.unwrap().attr("href").unwrap().to_owned();
    assert_eq!(browser.open(&older).await.status, 200);
    let invalid = browser.open("/organiser/log?actor=unknown").await;
    assert_eq!(invalid.status, 422);
    assert!(
        invalid.body.contains("expected organiser"),
        "{}",
        invalid.body
    );
}

#[tokio::test]
async fn registration_link_shows_its_status() {
    let site = Site::start().await;
    let mut browser = Browser::new(&site);
    let closed = browser.open("/register").await;
    assert!(closed.body.contains("Registration is closed"));
    let open = json!({ "takes_registrations": true });
    site.patch("/api/v1/season", Some(ADMIN), &open)
        .await
        .json(200);
    let terms = json!({ "text": "Be <b>fair</b>." });
    site.post("/api/v1/terms", Some(ADMIN), &terms)
        .await
        .json(201);
    let page = browser.open("/register").await;
    assert!(page.body.contains("Be &#60;b&#62;fair"), "{}", page.body);
    let fields = [("team_name", "Alpha"), ("contact", "ada at example.org")];
    let refused = browser.submit("/register", &fields).await;
    assert_eq!(refused.status, 409);
    assert!(first_text(&refused, "[role=alert]").contains("version 1"));
    let with_terms = [fields[0], fields[1], ("accepted_terms", "1")];
    let registered = browser.submit("/register", &with_terms).await;
    assert_eq!(registered.status, 201);
    let link = first_text(&registered, "section a");
    let status_page = browser.open(&link).await;
    assert_eq!(
        first_text(&status_page, "h1"),
        "Alpha is waiting for approval"
    );
    let listed = site
        .get("/api/v1/registrations", Some(ADMIN))
        .await
        .json(200);
    let approve = format!("/api/v1/registrations/{}/approve", string(&listed[0]["id"]));
    site.post(&approve, Some(ADMIN), &json!({})).await.json(200);
    assert_eq!(
        first_text(&browser.open(&link).await, "h1"),
        "Join the team Alpha"
    );
    let fields = [
        ("name", "Ada"),
        ("password", PASSWORD),
        ("accepted_terms", "1"),
    ];
    assert_eq!(
        browser.submit(&link, &fields).await.header("location"),
        "/account"
    );
}

#[tokio::test]
async fn founder_names_the_team_and_foreign_forms_are_refused() {
    let site = Site::start().await;
    let link = invite(&site, json!({ "role": "founder", "note": "Ada" })).await;
    let mut browser = Browser::new(&site);
    let fields = [("name", "Ada"), ("password", PASSWORD)];
    let nameless = browser.submit(&link, &fields).await;
    assert!(first_text(&nameless, "[role=alert]").contains("team's name"));
    let foreign = browser
        .http
        .post(format!("{}{link}", site.url))
        .header("origin", "https://evil.example")
        .header("content-type", "application/x-www-form-urlencoded")
        .body("name=Eve");
    let foreign = browser.send(foreign).await;
    assert_eq!(foreign.status, 403);
    let invalid = [
        fields[0],
        fields[1],
        ("team_name", "Alpha"),
        ("link", "ftp://x"),
    ];
    let refused = browser.submit(&link, &invalid).await;
    assert!(first_text(&refused, "[role=alert]").contains("https://"));
    let valid = [
        fields[0],
        fields[1],
        ("team_name", "Alpha"),
        ("affiliation", "TU"),
    ];
    assert_eq!(browser.submit(&link, &valid).await.status, 303);
    let account = browser.open("/account").await;
    assert!(account.body.contains("Alpha"));
}
