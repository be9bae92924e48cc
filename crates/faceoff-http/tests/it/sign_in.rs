//! The pages on which people join, register and sign in, as a browser uses them.

use crate::{
    browser::{Browser, PASSWORD, first, invited},
    site::{ADMIN, Site, text},
};
use reqwest::Method;
use scraper::{Html, Selector};
use serde_json::json;

#[tokio::test]
async fn somebody_follows_a_link_signs_out_and_signs_in_again() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let link = invited(
        &site,
        json!({ "role": "member", "team": team.id, "note": "Ada" }),
    )
    .await;
    let mut browser = Browser::new(&site);
    let page = browser.open(&link).await;
    assert_eq!(
        (page.status.as_u16(), first(&page, "h1")),
        (200, "Join the team Alpha".into())
    );
    let short = [("name", "Ada"), ("password", "short")];
    let refused = browser.submit(&link, &short).await;
    assert_eq!(refused.status, 422);
    assert!(
        first(&refused, "[role=alert]").contains("12 or more"),
        "{}",
        refused.body
    );
    assert!(
        refused.body.contains("value=\"Ada\""),
        "what was filled in is still there"
    );
    assert!(!refused.body.contains("value=\"short\""));
    let fields = [("name", "Ada"), ("password", PASSWORD)];
    let joined = browser.submit(&link, &fields).await;
    assert_eq!(
        (joined.status.as_u16(), joined.header("location")),
        (303, "/account")
    );
    let account = browser.open("/account").await;
    assert_eq!(first(&account, "h1"), "Ada");
    assert!(account.body.contains("Alpha"));
    assert!(
        !account.body.contains("/organiser"),
        "that is for organisers"
    );
    let spent = browser.submit(&link, &fields).await;
    assert_eq!(spent.status, 409);
    assert!(spent.body.contains("was accepted"), "{}", spent.body);

    let out = browser.submit("/sign-out", &[]).await;
    assert_eq!(out.header("location"), "/");
    assert_eq!(browser.cookie, None);
    assert_eq!(
        browser.open("/account").await.header("location"),
        "/sign-in"
    );
    let wrong = browser
        .submit("/sign-in", &[("name", "Ada"), ("password", "wrong")])
        .await;
    assert_eq!(wrong.status, 401);
    assert!(first(&wrong, "[role=alert]").contains("do not belong together"));
    let in_again = browser
        .submit("/sign-in", &[("name", "ada"), ("password", PASSWORD)])
        .await;
    assert_eq!(in_again.header("location"), "/account");
    assert_eq!(browser.open("/organiser/log").await.status, 403);
}

#[tokio::test]
async fn an_organiser_reads_the_log_on_its_page() {
    let site = Site::start().await;
    let link = invited(&site, json!({ "role": "organiser", "note": "Grace" })).await;
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
    let nonsense = browser.open("/organiser/log?actor=nobody").await;
    assert_eq!(nonsense.status, 422);
    assert!(
        nonsense.body.contains("expected organiser"),
        "{}",
        nonsense.body
    );
}

#[tokio::test]
async fn a_team_registers_on_the_page_and_its_link_says_where_it_stands() {
    let site = Site::start().await;
    let mut browser = Browser::new(&site);
    let closed = browser.open("/register").await;
    assert!(closed.body.contains("Registration is closed"));
    let open = site
        .request(Method::PATCH, "/api/v1/season", Some(ADMIN))
        .json(&json!({ "takes_registrations": true }));
    open.send().await.unwrap();
    let terms = json!({ "text": "Be <b>fair</b>." });
    site.post("/api/v1/terms", Some(ADMIN), &terms)
        .await
        .json(201);
    let page = browser.open("/register").await;
    assert!(page.body.contains("Be &#60;b&#62;fair"), "{}", page.body);
    let fields = [("team_name", "Alpha"), ("contact", "ada at example.org")];
    let refused = browser.submit("/register", &fields).await;
    assert_eq!(refused.status, 409);
    assert!(first(&refused, "[role=alert]").contains("version 1"));
    let consenting = [fields[0], fields[1], ("accepted_terms", "1")];
    let done = browser.submit("/register", &consenting).await;
    assert_eq!(done.status, 201);
    let link = first(&done, "section a");
    let waiting = browser.open(&link).await;
    assert_eq!(first(&waiting, "h1"), "Alpha waits for the organisers");
    let listed = site
        .get("/api/v1/registrations", Some(ADMIN))
        .await
        .json(200);
    let approve = format!("/api/v1/registrations/{}/approve", text(&listed[0]["id"]));
    site.post(&approve, Some(ADMIN), &json!({})).await.json(200);
    assert_eq!(
        first(&browser.open(&link).await, "h1"),
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
async fn a_founder_names_the_team_and_a_foreign_page_signs_nobody_in() {
    let site = Site::start().await;
    let link = invited(&site, json!({ "role": "founder", "note": "Ada" })).await;
    let mut browser = Browser::new(&site);
    let fields = [("name", "Ada"), ("password", PASSWORD)];
    let without = browser.submit(&link, &fields).await;
    assert!(first(&without, "[role=alert]").contains("team's name"));
    let foreign = browser
        .http
        .post(format!("{}{link}", site.url))
        .header("origin", "https://evil.example")
        .header("content-type", "application/x-www-form-urlencoded")
        .body("name=Eve");
    let foreign = browser.send(foreign).await;
    assert_eq!(foreign.status, 403);
    let bad = [
        fields[0],
        fields[1],
        ("team_name", "Alpha"),
        ("link", "ftp://x"),
    ];
    let refused = browser.submit(&link, &bad).await;
    assert!(first(&refused, "[role=alert]").contains("https://"));
    let good = [
        fields[0],
        fields[1],
        ("team_name", "Alpha"),
        ("affiliation", "TU"),
    ];
    assert_eq!(browser.submit(&link, &good).await.status, 303);
    let account = browser.open("/account").await;
    assert!(account.body.contains("Alpha"));
}
