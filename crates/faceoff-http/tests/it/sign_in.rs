//! Tests of the pages to join (by an invitation's link), register and sign in, with a browser without scripts.

use crate::{
    browser::{Browser, PASSWORD, first_text, forms, invite},
    html::{attributes, links, texts},
    site::{ADMIN, Answer, Site, string},
};
use reqwest::Method;
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
        (303, "/dashboard")
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
        "/sign-in?next=%2Faccount"
    );
    let wrong = browser
        .submit("/sign-in", &[("name", "Ada"), ("password", "wrong")])
        .await;
    assert_eq!(wrong.status, 401);
    assert!(first_text(&wrong, "[role=alert]").contains("name or password"));
    let signed_in = browser
        .submit("/sign-in", &[("name", "ada"), ("password", PASSWORD)])
        .await;
    assert_eq!(signed_in.header("location"), "/dashboard");
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
        "/dashboard"
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
    let request_of_other_site = browser
        .http
        .post(format!("{}{link}", site.url))
        .header("origin", "https://evil.example")
        .header("content-type", "application/x-www-form-urlencoded")
        .body("name=Eve");
    let refused = browser.send(request_of_other_site).await;
    assert_eq!(refused.status, 403);
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

#[tokio::test]
async fn navigation_names_user_and_pending_decisions() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let role = json!({ "role": "member", "team": team.id, "note": "Ada" });
    let mut ada = Browser::join(&site, "Ada O'Neil", role).await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::join(&site, "Grace", role).await;
    let mut visitor = Browser::new(&site);
    let entries = "header nav li";
    // A visitor's page is the same for all, and has no names.
    for path in ["/", "/season", "/docs", "/no-such-page"] {
        let page = Html::parse_document(&visitor.open(path).await.body);
        assert_eq!(texts(&page, entries).last().unwrap(), "Account", "{path}");
        let page = Html::parse_document(&ada.open(path).await.body);
        let ada_entries = texts(&page, entries);
        assert_eq!(
            ada_entries[ada_entries.len() - 2..],
            ["Dashboard", "Ada O'Neil"],
            "{path}"
        );
        assert!(links(&page, "header nav a").contains(&"/dashboard".to_owned()));
        let page = Html::parse_document(&grace.open(path).await.body);
        let grace_entries = texts(&page, entries);
        assert_eq!(
            grace_entries[grace_entries.len() - 2..],
            ["Dashboard", "Grace"],
            "{path}"
        );
        assert!(links(&page, "header nav a").contains(&"/organiser".to_owned()));
    }
    let open = json!({ "takes_registrations": true });
    site.patch("/api/v1/season", Some(ADMIN), &open)
        .await
        .json(200);
    let fields = [("team_name", "Beta"), ("contact", "ben at example.org")];
    assert_eq!(visitor.submit("/register", &fields).await.status, 201);
    ada.submit("/dashboard/questions", &[("text", "When?")])
        .await;
    let badge = async |browser: &mut Browser<'_>| {
        let page = Html::parse_document(&browser.open("/season").await.body);
        texts(&page, ".badge")
    };
    assert_eq!(badge(&mut grace).await, ["2 pending decisions"]);
    assert!(badge(&mut ada).await.is_empty());
    assert!(badge(&mut visitor).await.is_empty());
    let question = site.get("/api/v1/questions", Some(ADMIN)).await.json(200);
    let answer = format!("/organiser/messages/{}", string(&question[0]["id"]));
    grace.submit(&answer, &[("text", "Soon.")]).await;
    assert_eq!(badge(&mut grace).await, ["1 pending decision"]);
    // The same board has different tags for different viewers, who thus never get each other's page.
    let tag = |answer: crate::site::Answer| answer.header("etag").to_owned();
    let tags = [
        tag(visitor.open("/").await),
        tag(ada.open("/").await),
        tag(grace.open("/").await),
    ];
    assert!(tags[0] != tags[1] && tags[1] != tags[2] && tags[0] != tags[2]);
}

#[tokio::test]
async fn expired_session_keeps_the_typed_form() {
    let site = Site::start().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::join(&site, "Grace", role).await;
    // The cookie of a session that has ended.
    let expired = "faceoff_session=fo_session_0000";
    grace.cookie = Some(expired.to_owned());
    let text = "Line <1>\r\nline \"2\"";
    let typed = [
        ("title", "No day on Sunday"),
        ("text", text),
        ("password", "my secret"),
        ("confirm", "yes"),
    ];
    let asked = grace.submit("/organiser/messages", &typed).await;
    assert_eq!(asked.status, 401);
    assert!(first_text(&asked, "[role=alert]").contains("What you typed is kept"));
    assert!(!asked.body.contains("my secret"), "{}", asked.body);
    let sign_in = forms("/organiser/messages", &asked)
        .into_iter()
        .find(|form| form.action == "/sign-in")
        .unwrap();
    let send = async |browser: &mut Browser<'_>, password: &str| {
        let fields: Vec<(&str, &str)> = sign_in
            .fields
            .iter()
            .map(|(name, value)| match name.as_str() {
                "name" => ("name", "Grace"),
                "password" => ("password", password),
                name => (name, value.as_str()),
            })
            .collect();
        browser.submit("/sign-in", &fields).await
    };
    // A wrong password loses nothing either.
    let wrong = send(&mut grace, "wrong").await;
    assert_eq!(wrong.status, 401);
    let form_after_refusal = forms("/sign-in", &wrong).remove(0);
    let kept = ("kept.title".to_owned(), "No day on Sunday".to_owned());
    assert!(
        form_after_refusal.fields.contains(&kept),
        "{form_after_refusal:?}"
    );

    let signed_in = send(&mut grace, PASSWORD).await;
    assert_eq!(signed_in.status, 200);
    assert_ne!(grace.cookie.as_deref(), Some(expired));
    let form = forms("/sign-in", &signed_in)
        .into_iter()
        .find(|form| form.action == "/organiser/messages")
        .unwrap();
    // Without the password and the confirmation, which are never kept.
    let names: Vec<&str> = form.fields.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["title", "text"]);
    let page = Html::parse_document(&signed_in.body);
    let navigation = texts(&page, "header nav li");
    assert_eq!(navigation.last().unwrap(), "Grace");
    let announcements = site.get("/api/v1/announcements", None).await.json(200);
    assert_eq!(announcements, json!([]), "nothing is sent by signing in");
    let fields: Vec<(&str, &str)> = form
        .fields
        .iter()
        .map(|(name, value)| (name.as_str(), value.as_str()))
        .collect();
    let sent = grace.submit(&form.action, &fields).await;
    assert_eq!(
        sent.header("location"),
        "/organiser/messages?done=announced"
    );
    let announcements = site.get("/api/v1/announcements", None).await.json(200);
    assert_eq!(announcements[0]["title"], "No day on Sunday");
    assert_eq!(announcements[0]["text"], "Line <1>\nline \"2\"");
}

#[tokio::test]
async fn session_secret_is_no_bearer_token_of_a_page() {
    let site = Site::start().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::join(&site, "Grace", role).await;
    assert_eq!(grace.open("/organiser").await.status, 200);
    let cookie = grace.cookie.clone().unwrap();
    let (_, secret) = cookie.split_once('=').unwrap();
    let request = site.request(Method::GET, "/organiser", Some(secret));
    // The cookie is valid, but the header has precedence.
    for request in [
        request.try_clone().unwrap().header("cookie", &cookie),
        request,
    ] {
        let refused = Answer::read(request.send().await.unwrap()).await;
        let page = refused.html(401);
        assert!(texts(&page, "main")[0].contains("session cookie"));
    }
}

#[tokio::test]
async fn hidden_fields_of_a_kept_form_stay_hidden() {
    let site = Site::start().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::join(&site, "Grace", role).await;
    let session = grace.cookie.take();
    let person = "6b1f0a1e-6f0b-4d3a-9b57-0d8f2f3f7a11";
    let typed = [("role", "return"), ("person", person), ("note", "for Ben")];
    let asked = grace.submit("/organiser/access/invitations", &typed).await;
    let sign_in = forms("/sign-in", &asked)
        .into_iter()
        .find(|form| form.action == "/sign-in")
        .unwrap();
    let mut fields: Vec<(&str, &str)> = vec![("name", "Grace"), ("password", PASSWORD)];
    fields.extend(
        sign_in
            .fields
            .iter()
            .map(|(name, value)| (name.as_str(), value.as_str()))
            .filter(|(name, _)| !["name", "password"].contains(name)),
    );
    let page = grace.submit("/sign-in", &fields).await;
    assert_ne!(grace.cookie, session);
    let html = page.html(200);
    let names = |selector: &str| attributes(&html, selector, "name");
    assert_eq!(names("main input[type=hidden]"), ["role", "person"]);
    assert_eq!(names("main input:not([type=hidden])"), ["note"]);
    assert_eq!(texts(&html, "main label"), ["Note"]);
}

#[tokio::test]
async fn database_failure_shows_the_form_and_no_sign_in() {
    let site = Site::start().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::join(&site, "Grace", role).await;
    site.store.close().await;
    let typed = [
        ("title", "No day on Sunday"),
        ("text", "It rains."),
        ("password", "my secret"),
    ];
    let failed = grace.submit("/organiser/messages", &typed).await;
    let html = failed.html(500);
    assert!(
        !texts(&html, "h1")[0].contains("Sign in"),
        "{}",
        failed.body
    );
    assert!(texts(&html, "[role=alert]")[0].contains("x-request-id"));
    assert!(!failed.body.contains("my secret"), "{}", failed.body);
    let form = forms("/organiser/messages", &failed).remove(0);
    assert_eq!(form.action, "/organiser/messages");
    let title = ("title".to_owned(), "No day on Sunday".to_owned());
    assert!(form.fields.contains(&title), "{form:?}");
    // Without anything typed the page shows the problem alone.
    let failed = grace.submit("/organiser/decide/resume", &[]).await;
    assert_eq!(failed.status, 500);
    assert!(forms("/organiser", &failed).is_empty(), "{}", failed.body);
}

#[tokio::test]
async fn form_of_another_site_is_not_kept() {
    let site = Site::start().await;
    let mut browser = Browser::new(&site);
    let form = crate::browser::Form {
        action: "/organiser/messages".to_owned(),
        is_post: true,
        is_multipart: false,
        fields: vec![("title".to_owned(), "evil title".to_owned())],
    };
    for answer in browser.submit_from_foreign_page(&form).await {
        assert!(!answer.body.contains("evil title"), "{}", answer.body);
    }
    // Fields of the sign-in page that claim to be a kept form lead to no other site either.
    let fields = [("form", "https://evil.example/organiser"), ("kept.a", "b")];
    let role = json!({ "role": "organiser", "note": "Grace" });
    drop(Browser::join(&site, "Grace", role).await);
    let mut all = vec![("name", "Grace"), ("password", PASSWORD)];
    all.extend(fields);
    let signed_in = browser.submit("/sign-in", &all).await;
    assert_eq!(signed_in.header("location"), "/dashboard");
    assert!(!signed_in.body.contains("evil"));
}
