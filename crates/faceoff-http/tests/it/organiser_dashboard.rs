//! Tests of the organiser dashboard (the pages below `/organiser`) with a browser without scripts. Each decision has a page of
//! its own, which shows its effects and a form.

use crate::{
    browser::{Browser, forms},
    html::{links, texts},
    site::{ADMIN, Answer, Site, TestTeam, result, string},
    team_dashboard::{dashboard_page, redirect_target},
};
use scraper::Html;
use serde_json::{Value, json};

/// The browser of Grace, an organiser.
async fn grace(site: &Site) -> Browser<'_> {
    let role = json!({ "role": "organiser", "note": "Grace" });
    Browser::join(site, "Grace", role).await
}

/// The newest event of a kind; null if there is none.
async fn newest_event(site: &Site, kind: &str) -> Value {
    let path = format!("/api/v1/events?limit=1&kind={kind}");
    site.get(&path, Some(ADMIN)).await.json(200)["events"][0].clone()
}

/// Opens the first decision page that the page at `path` links to and whose own path contains `decision`. Returns its path and
/// the page.
async fn open_decision(grace: &mut Browser<'_>, path: &str, decision: &str) -> (String, Answer) {
    let html = dashboard_page(&grace.open(path).await, 200);
    let found = links(&html, "a[href*='/organiser/decide/']")
        .into_iter()
        .find(|link| link.contains(&format!("/{decision}")));
    let link = found.unwrap_or_else(|| panic!("no {decision} on {path}"));
    let page = grace.open(&link).await;
    (link, page)
}

/// Pages of the organiser dashboard.
const PAGES: [&str; 12] = [
    "/organiser",
    "/organiser/day",
    "/organiser/teams",
    "/organiser/stages",
    "/organiser/tournaments",
    "/organiser/messages",
    "/organiser/storage",
    "/organiser/workers",
    "/organiser/access",
    "/organiser/log",
    "/organiser/settings",
    "/organiser/decide/pause",
];

#[tokio::test]
async fn organiser_dashboard_is_for_organisers_only() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let role = json!({ "role": "member", "team": team.id, "note": "Ada" });
    let mut ada = Browser::join(&site, "Ada", role).await;
    let mut grace = grace(&site).await;
    let mut visitor = Browser::new(&site);
    for path in PAGES {
        let page = dashboard_page(&grace.open(path).await, 200);
        assert_eq!(texts(&page, "h1").len(), 1, "{path}");
        assert!(
            redirect_target(&visitor.open(path).await).starts_with("/sign-in?next=%2Forganiser")
        );
        // These pages exist for members, too, with their own users, tokens and settings.
        if !["/organiser/access", "/organiser/settings"].contains(&path) {
            let refused = ada.open(path).await;
            assert_eq!(refused.status, 403, "{path}");
            assert!(
                refused.body.contains("is for organisers"),
                "{}",
                refused.body
            );
            assert!(
                refused.body.contains("/dashboard"),
                "a link to the member's own dashboard"
            );
        }
    }
    let member_page = ada.open("/organiser/access").await;
    assert!(!member_page.body.contains("Grace"), "{}", member_page.body);
    let paused = [("reason", "mine")];
    let refused = ada.submit("/organiser/decide/pause", &paused).await;
    assert_eq!(refused.status, 403);
    assert_eq!(newest_event(&site, "queue_paused").await, Value::Null);
    assert_eq!(
        redirect_target(&grace.open("/dashboard").await),
        "/organiser"
    );
    assert_eq!(grace.open("/dashboard/submissions/x").await.status, 403);
    assert_eq!(grace.open("/organiser/decide/nothing").await.status, 404);
}

#[tokio::test]
async fn evaluation_is_voided_with_a_reason_and_rerun() {
    let site = Site::start().await;
    site.add_ranked_teams(&[("Alpha", result([0.9; 3], 10.0))])
        .await;
    let mut grace = grace(&site).await;
    let (link, page) = open_decision(&mut grace, "/organiser/day", "void/").await;
    let html = dashboard_page(&page, 200);
    assert_eq!(
        texts(&html, "h1"),
        ["Void the evaluation of 2026-03-01 by Alpha"]
    );
    assert!(
        texts(&html, "#effects")[0]
            .starts_with("The evaluation of 2026-03-01 by Alpha will disappear")
    );
    assert_eq!(
        newest_event(&site, "evaluation_voided").await,
        Value::Null,
        "opening the page voids nothing"
    );
    let form = forms(&link, &page).remove(0);
    let mut send = async |reason: &str| {
        let fields: Vec<(&str, &str)> = form
            .fields
            .iter()
            .map(|(name, value)| match name.as_str() {
                "reason" => ("reason", reason),
                name => (name, value.as_str()),
            })
            .collect();
        grace.submit(&form.action, &fields).await
    };
    let html = dashboard_page(&send(" ").await, 422);
    assert!(texts(&html, "[role=alert]")[0].contains("1 to 500 characters"));
    let target = redirect_target(&send("the <b>camera</b> fell").await);
    assert!(target.starts_with("/organiser/day?stage=") && target.ends_with("&done=voided"));
    let event = newest_event(&site, "evaluation_voided").await;
    assert_eq!(event["actor_name"], "Grace", "{event}");
    let again = dashboard_page(&send("twice").await, 409);
    assert_eq!(
        texts(&again, "textarea"),
        ["twice"],
        "the form keeps the reason"
    );

    let html = dashboard_page(&grace.open(&target).await, 200);
    assert!(texts(&html, "[role=status]")[0].contains("no longer counts"));
    let row = texts(&html, "section[aria-labelledby=evaluations] tbody tr").remove(0);
    assert!(row.contains("voided the <b>camera</b> fell"), "{row}");
    let (link, _) = open_decision(&mut grace, "/organiser/day", "rerun/").await;
    assert!(redirect_target(&grace.submit(&link, &[]).await).ends_with("done=rerun"));
    let (link, page) = open_decision(&mut grace, "/organiser/day", "cancel/").await;
    assert!(texts(&dashboard_page(&page, 200), "#effects")[0].contains("0 of 12 episodes"));
    let cancelled = grace.submit(&link, &[("reason", "later")]).await;
    assert!(redirect_target(&cancelled).ends_with("done=cancelled"));
    assert_eq!(
        newest_event(&site, "evaluation_cancelled").await["actor_name"],
        "Grace"
    );
}

#[tokio::test]
async fn organiser_starts_and_corrects_days_and_pauses_the_queue() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "agent").await;
    let mut grace = grace(&site).await;
    let overview = dashboard_page(&grace.open("/organiser").await, 200);
    let attention = texts(&overview, "section[aria-labelledby=attention]").remove(0);
    assert!(attention.contains("no failures"), "{attention}");

    let (link, page) = open_decision(&mut grace, "/organiser/day", "start-day/").await;
    let effects = texts(&dashboard_page(&page, 200), "#effects").remove(0);
    assert!(
        effects.contains("1 team will have 12 episodes to run"),
        "{effects}"
    );
    assert!(redirect_target(&grace.submit(&link, &[]).await).ends_with("done=started"));
    assert_eq!(
        newest_event(&site, "day_started").await["actor_name"],
        "Grace"
    );
    let twice = dashboard_page(&grace.submit(&link, &[]).await, 409);
    assert!(texts(&twice, "[role=alert]")[0].contains("had its cut"));

    let (link, _) = open_decision(&mut grace, "/organiser/day", "pause").await;
    let paused = grace.submit(&link, &[("reason", "the fan is loud")]).await;
    assert!(redirect_target(&paused).contains("done=paused"));
    let html = dashboard_page(&grace.open("/organiser").await, 200);
    let item = texts(&html, ".attention li").remove(0);
    assert!(
        item.contains("The queue is paused") && item.contains("the fan is loud"),
        "{item}"
    );
    let (link, page) = open_decision(&mut grace, "/organiser", "resume").await;
    assert!(texts(&dashboard_page(&page, 200), "#effects")[0].contains("the fan is loud"));
    assert!(redirect_target(&grace.submit(&link, &[]).await).contains("done=resumed"));

    // An extra evaluation, a voided day, and a missed day that is made up.
    site.finish_evaluation(&result([0.5; 3], 10.0)).await;
    let (link, page) = open_decision(&mut grace, "/organiser/day", "extra-evaluation/").await;
    assert!(texts(&dashboard_page(&page, 200), "#effects")[0].contains("voided at once"));
    let form = forms(&link, &page).remove(0);
    assert!(form.fields.contains(&("confirm".into(), "Alpha".into())));
    let fields = [("reason", "lost an hour"), ("confirm", "Alpha")];
    assert!(
        redirect_target(&grace.submit(&link, &fields).await).ends_with("done=extra-evaluation")
    );
    let unconfirmed = [("reason", "all of it")];
    let (link, _) = open_decision(&mut grace, "/organiser/day", "void-day/").await;
    let refused = dashboard_page(&grace.submit(&link, &unconfirmed).await, 409);
    assert!(texts(&refused, "[role=alert]")[0].contains("Nothing is done yet"));
    let confirmed = [("reason", "all of it"), ("confirm", "2026-03-01")];
    assert!(redirect_target(&grace.submit(&link, &confirmed).await).ends_with("done=day-voided"));
    site.set_time("2026-03-04T10:00:00Z".parse().unwrap());
    let stage = string(&site.get("/api/v1/stages", None).await.json(200)[0]["id"]);
    let missed = format!("/organiser/day?stage={stage}&day=2026-03-03");
    let (link, _) = open_decision(&mut grace, &missed, "missed-day/").await;
    let started = grace.submit(&link, &[("reason", "power failure")]).await;
    assert!(redirect_target(&started).ends_with("done=missed"));
    let html = dashboard_page(&grace.open(&missed).await, 200);
    assert!(texts(&html, "section[aria-labelledby=day]")[0].contains("power failure"));
}

#[tokio::test]
async fn platform_fault_needs_attention_until_the_rerun() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "agent").await;
    site.start_day().await;
    site.change_first_stage(json!({ "day_deadline": { "hours": 1 } }))
        .await
        .json(200);
    site.advance(3700);
    site.store.end_overdue_days(site.now()).await.unwrap();
    let mut grace = grace(&site).await;
    let html = dashboard_page(&grace.open("/organiser").await, 200);
    let item = texts(&html, ".attention li.bad").remove(0);
    assert!(
        item.contains("Alpha’s evaluation of 2026-03-01 was not finished in time"),
        "{item}"
    );
    let (link, _) = open_decision(&mut grace, "/organiser", "rerun/").await;
    assert!(redirect_target(&grace.submit(&link, &[]).await).ends_with("done=rerun"));
    let html = dashboard_page(&grace.open("/organiser").await, 200);
    assert!(
        !texts(&html, ".attention li")
            .join(" ")
            .contains("not finished in time"),
        "the rerun is queued"
    );
}

#[tokio::test]
async fn organiser_approves_changes_and_disqualifies_teams() {
    let site = Site::start().await;
    let mut grace = grace(&site).await;
    let season = [
        ("takes_registrations", "on"),
        ("divisions", "Students\r\nOpen"),
    ];
    let changed = grace.submit("/organiser/teams/season", &season).await;
    assert_eq!(
        redirect_target(&changed),
        "/organiser/teams?done=season-changed"
    );
    let mut visitor = Browser::new(&site);
    for name in ["Alpha", "Beta"] {
        let fields = [("team_name", name), ("contact", "ada at example.org")];
        assert_eq!(visitor.submit("/register", &fields).await.status, 201);
    }
    let html = dashboard_page(&grace.open("/organiser").await, 200);
    assert_eq!(texts(&html, ".attention > li").len(), 2);
    let ids = |html| {
        let links = links(html, "a[href*='/decide/approve/']");
        links
            .into_iter()
            .map(|link| link.replace("/organiser/decide/approve/", ""))
    };
    for id in ids(&html) {
        let approve = format!("/organiser/decide/approve/{id}");
        let page = dashboard_page(&grace.open(&approve).await, 200);
        if texts(&page, "h1")[0] == "Approve the registration of Alpha" {
            assert!(redirect_target(&grace.submit(&approve, &[]).await).ends_with("done=approved"));
        } else {
            let refuse = format!("/organiser/decide/refuse/{id}");
            let refused = grace.submit(&refuse, &[("reason", "too late")]).await;
            assert!(redirect_target(&refused).ends_with("done=refused"));
        }
    }
    let teams = site.get("/api/v1/teams", Some(ADMIN)).await.json(200);
    assert_eq!(teams.as_array().unwrap().len(), 1);
    let id = string(&teams[0]["id"]);
    let changes = [("division", "Students"), ("baseline", "on")];
    let changed = grace
        .submit(&format!("/organiser/teams/{id}"), &changes)
        .await;
    assert_eq!(
        redirect_target(&changed),
        "/organiser/teams?done=team-changed"
    );
    let team = site
        .get(&format!("/api/v1/teams/{id}"), None)
        .await
        .json(200);
    assert_eq!(
        (&team["division"], &team["baseline"]),
        (&json!("Students"), &json!(true))
    );
    assert_eq!(
        newest_event(&site, "team_made_baseline").await["actor_name"],
        "Grace"
    );
    let unknown_division = [("division", "Masters")];
    let refused = grace
        .submit(&format!("/organiser/teams/{id}"), &unknown_division)
        .await;
    dashboard_page(&refused, 409);

    let (link, page) = open_decision(&mut grace, "/organiser/teams", "disqualify/").await;
    assert!(
        texts(&dashboard_page(&page, 200), "#effects")[0]
            .starts_with("The team Alpha will disappear from all boards")
    );
    let fields = [("reason", "it read the seed"), ("confirm", "Alpha")];
    assert!(redirect_target(&grace.submit(&link, &fields).await).ends_with("done=disqualified"));
    assert_eq!(
        newest_event(&site, "team_disqualified").await["actor_name"],
        "Grace"
    );
    let (link, _) = open_decision(&mut grace, "/organiser/teams", "reinstate/").await;
    let target = grace.submit(&link, &[("reason", "a mistake")]).await;
    assert!(redirect_target(&target).ends_with("done=reinstated"));

    let html = dashboard_page(&grace.open("/organiser/access").await, 200);
    assert_eq!(texts(&html, "#role option").len(), 3);
    let founder = [("role", "founder"), ("team", ""), ("note", "Gamma")];
    let created = grace
        .submit("/organiser/access/invitations", &founder)
        .await;
    // The links have the address of the page that shows them.
    let path_of_link = |created: &Html| -> String {
        let link = texts(created, ".secret code").remove(0);
        let path = link.strip_prefix(&site.url);
        path.unwrap_or_else(|| panic!("{link}")).to_owned()
    };
    let link = path_of_link(&dashboard_page(&created, 201));
    assert!(visitor.open(&link).await.body.contains("Create your team"));
    let member = [("role", "member"), ("team", ""), ("note", "Ada")];
    let refused = grace.submit("/organiser/access/invitations", &member).await;
    let html = dashboard_page(&refused, 422);
    assert!(texts(&html, "[role=alert]")[0].contains("choose an entry of the list"));
    let member = [("role", "member"), ("team", id.as_str()), ("note", "Ada")];
    let created = grace.submit("/organiser/access/invitations", &member).await;
    let link = path_of_link(&dashboard_page(&created, 201));
    assert!(
        visitor
            .open(&link)
            .await
            .body
            .contains("Join the team Alpha")
    );
}

#[tokio::test]
async fn organiser_creates_changes_freezes_and_signs_off_a_stage() {
    let site = Site::start().await;
    let mut grace = grace(&site).await;
    let stage = string(&site.get("/api/v1/stages", None).await.json(200)[0]["id"]);
    let path = format!("/organiser/stages/{stage}");
    // The fields of the stage's form on a page, with some values changed.
    let form = |page: &Answer, changes: &[(&str, &str)]| {
        let forms = forms(&path, page);
        let form = forms
            .iter()
            .find(|form| form.is_post && form.action == path);
        let mut fields = form.unwrap().fields.clone();
        for (name, value) in changes {
            fields.retain(|(field, _)| field != name);
            fields.push(((*name).to_owned(), (*value).to_owned()));
        }
        fields
    };
    let mut send = async |fields: Vec<(String, String)>| {
        let fields: Vec<_> = fields
            .iter()
            .map(|(name, value)| (name.as_str(), value.as_str()))
            .collect();
        grace.submit(&path, &fields).await
    };
    let get = async || {
        site.get(&format!("/api/v1/stages/{stage}"), None)
            .await
            .json(200)
    };

    // Submitting the form unchanged changes nothing.
    let mut browser =
        Browser::join(&site, "Hal", json!({ "role": "organiser", "note": "Hal" })).await;
    let page = browser.open(&path).await;
    dashboard_page(&page, 200);
    let before = get().await;
    assert!(redirect_target(&send(form(&page, &[])).await).ends_with("done=stage-changed"));
    assert_eq!(get().await, before);
    let daily = form(
        &page,
        &[
            ("schedule", "06:30"),
            ("days_off", "2026-12-24, 2026-12-25"),
        ],
    );
    assert!(redirect_target(&send(daily).await).ends_with("done=stage-changed"));
    let schedule = &get().await["schedule"];
    assert_eq!(
        *schedule,
        json!({ "daily": "06:30:00", "days_off": ["2026-12-24", "2026-12-25"] })
    );
    assert_eq!(
        newest_event(&site, "stage_changed").await["actor_name"],
        "Grace"
    );
    let page = browser.open(&path).await;
    for (name, value, words) in [
        ("schedule", "25:00", "schedule"),
        ("day_deadline", "soon", "expected next-cut, never"),
        ("zone", "Mars/Olympus", "zone"),
        ("episodes_per_task", "many", "whole number"),
        ("closes_at", "later", "closes_at"),
    ] {
        let refused = send(form(&page, &[(name, value)])).await;
        let html = dashboard_page(&refused, 422);
        assert!(
            texts(&html, "[role=alert]")[0].contains(words),
            "{}",
            refused.body
        );
        let mut kept_fields = forms(&path, &refused)
            .into_iter()
            .flat_map(|form| form.fields);
        assert!(kept_fields.any(|field| field == (name.into(), value.into())));
    }
    let cron = form(&page, &[("schedule", "0 6 * * 1-5"), ("days_off", "")]);
    assert!(redirect_target(&send(cron).await).ends_with("done=stage-changed"));
    assert_eq!(get().await["schedule"]["cron"], "0 6 * * 1-5");

    // Changing the rules of an open stage needs a confirmation.
    let page = browser.open(&path).await;
    let unconfirmed = send(form(&page, &[("episodes_per_task", "5")])).await;
    let html = dashboard_page(&unconfirmed, 409);
    assert!(texts(&html, "[role=alert]")[0].contains("begin revision 2"));
    assert_eq!(get().await["revision"], 1);
    let name = string(&get().await["name"]);
    let confirmed = form(&unconfirmed, &[("confirm", name.as_str())]);
    assert!(
        confirmed.contains(&("episodes_per_task".into(), "5".into())),
        "the form keeps the change"
    );
    assert!(unconfirmed.body.contains("name=\"confirm\""));
    assert!(redirect_target(&send(confirmed).await).ends_with("done=stage-changed"));
    let after = get().await;
    assert_eq!(
        (&after["revision"], &after["episodes_per_task"]),
        (&json!(2), &json!(5))
    );

    let (link, _) = open_decision(&mut grace, &path, "freeze/").await;
    assert!(
        redirect_target(&grace.submit(&link, &[("reason", "the final")]).await)
            .ends_with("done=frozen")
    );
    let (link, _) = open_decision(&mut grace, &path, "unfreeze/").await;
    assert!(redirect_target(&grace.submit(&link, &[]).await).ends_with("done=unfrozen"));
    let page = browser.open(&path).await;
    let closing = form(&page, &[("closes_at", "2026-03-01T11:00")]);
    let closing: Vec<_> = closing
        .iter()
        .map(|(name, value)| (name.as_str(), value.as_str()))
        .collect();
    assert!(redirect_target(&grace.submit(&path, &closing).await).ends_with("done=stage-changed"));
    site.advance(3600);
    let html = dashboard_page(&grace.open("/organiser").await, 200);
    assert!(texts(&html, ".attention li")[0].contains("its result is provisional"));
    let (link, page) = open_decision(&mut grace, &path, "sign-off/").await;
    assert!(texts(&dashboard_page(&page, 200), "#effects")[0].contains("signed off for good"));
    let confirm = [("confirm", name.as_str())];
    assert!(redirect_target(&grace.submit(&link, &confirm).await).ends_with("done=signed-off"));
    assert_eq!(
        get().await["finalised"]["by"],
        newest_event(&site, "stage_finalised").await["actor"]
    );

    // A second stage with the settings of the first.
    let page = grace.open("/organiser/stages").await;
    let form = forms("/organiser/stages", &page)
        .into_iter()
        .find(|form| form.is_post)
        .unwrap();
    let mut fields: Vec<(&str, &str)> = form
        .fields
        .iter()
        .map(|(name, value)| (name.as_str(), value.as_str()))
        .collect();
    let nameless = dashboard_page(&grace.submit("/organiser/stages", &fields).await, 422);
    assert!(texts(&nameless, "[role=alert]")[0].contains("name"));
    fields.retain(|(name, _)| *name != "name");
    fields.push(("name", "Second"));
    assert_eq!(
        redirect_target(&grace.submit("/organiser/stages", &fields).await),
        "/organiser/stages?done=stage-made"
    );
    let stages = site.get("/api/v1/stages", None).await.json(200);
    assert_eq!(stages[1]["name"], "Second");
    assert_eq!(stages[1]["episodes_per_task"], 5);
}

#[tokio::test]
async fn question_is_asked_by_a_team_and_answered_by_an_organiser() {
    let site = Site::start().await;
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let role = |team: &TestTeam| json!({ "role": "member", "team": team.id, "note": "a member" });
    let mut ada = Browser::join(&site, "Ada", role(&alpha)).await;
    let mut ben = Browser::join(&site, "Ben", role(&beta)).await;
    let mut grace = grace(&site).await;
    let words = [("text", "May <b>we</b>?")];
    let asked = ada.submit("/dashboard/questions", &words).await;
    assert_eq!(redirect_target(&asked), "/dashboard/questions?done=asked");
    let empty = dashboard_page(
        &ada.submit("/dashboard/questions", &[("text", " ")]).await,
        422,
    );
    assert!(texts(&empty, "[role=alert]")[0].contains("1 to 2000 characters"));
    let html = dashboard_page(&grace.open("/organiser").await, 200);
    assert!(texts(&html, ".attention li")[0].contains("1 open question"));

    let page = grace.open("/organiser/messages").await;
    let html = dashboard_page(&page, 200);
    assert!(
        texts(&html, ".entry")[0].contains("May <b>we</b>?Alpha,"),
        "{}",
        page.body
    );
    let form = forms("/organiser/messages", &page).remove(0);
    let answered = grace.submit(&form.action, &[("text", "You may.")]).await;
    assert_eq!(
        redirect_target(&answered),
        "/organiser/messages?done=answered"
    );
    assert_eq!(newest_event(&site, "answered").await["actor_name"], "Grace");
    let ada_page = dashboard_page(&ada.open("/dashboard/questions").await, 200);
    assert!(texts(&ada_page, ".entry")[0].contains("You may."));
    let ben_page = dashboard_page(&ben.open("/dashboard/questions").await, 200);
    assert!(
        texts(&ben_page, ".entry").is_empty(),
        "the answer is not public"
    );
    let public = [("text", "Everybody may."), ("public", "on")];
    redirect_target(&grace.submit(&form.action, &public).await);
    let ben_page = dashboard_page(&ben.open("/dashboard/questions").await, 200);
    let public_entry = texts(&ben_page, ".entry").remove(0);
    assert!(
        public_entry.contains("Everybody may.") && !public_entry.contains("Alpha"),
        "{public_entry}"
    );

    let news = [("title", "No day on Sunday"), ("text", "The power is off.")];
    let announced = grace.submit("/organiser/messages", &news).await;
    assert_eq!(
        redirect_target(&announced),
        "/organiser/messages?done=announced"
    );
    assert!(
        ben.open("/announcements")
            .await
            .body
            .contains("No day on Sunday")
    );
    let untitled = [("title", " "), ("text", "kept as typed")];
    let refused = dashboard_page(&grace.submit("/organiser/messages", &untitled).await, 422);
    assert!(texts(&refused, "textarea").contains(&"kept as typed".to_owned()));
    let terms = grace
        .submit("/organiser/messages/terms", &[("text", "Be fair.")])
        .await;
    assert_eq!(
        redirect_target(&terms),
        "/organiser/messages?done=published"
    );
    let html = dashboard_page(&ben.open("/dashboard").await, 200);
    assert_eq!(
        texts(&html, "section[aria-labelledby=terms] button"),
        ["Accept version 1"]
    );
}

#[tokio::test]
async fn organiser_forms_refuse_foreign_origins() {
    let site = Site::start().await;
    site.add_ranked_teams(&[("Alpha", result([0.9; 3], 10.0))])
        .await;
    let mut grace = grace(&site).await;
    let stage = string(&site.get("/api/v1/stages", None).await.json(200)[0]["id"]);
    let mut paths: Vec<String> = PAGES.map(str::to_owned).to_vec();
    paths.push(format!("/organiser/stages/{stage}"));
    let mut checked_forms = 0;
    let mut index = 0;
    while index < paths.len() {
        let path = paths[index].clone();
        index += 1;
        let page = grace.open(&path).await;
        let html = dashboard_page(&page, 200);
        for link in links(&html, "a[href^='/organiser/decide/']") {
            if !paths.contains(&link) {
                paths.push(link);
            }
        }
        for form in forms(&path, &page).into_iter().filter(|form| form.is_post) {
            let before = site.get("/api/v1/events?limit=1", Some(ADMIN)).await;
            for answer in grace.submit_from_foreign_page(&form).await {
                assert_eq!(answer.status, 403, "{form:?}: {}", answer.body);
            }
            let after = site.get("/api/v1/events?limit=1", Some(ADMIN)).await;
            assert_eq!(before.body, after.body, "{form:?} changed something");
            checked_forms += 1;
        }
    }
    for decision in [
        "void/",
        "void-day/",
        "extra-evaluation/",
        "disqualify/",
        "freeze/",
        "pause",
    ] {
        let found = paths.iter().any(|path| path.contains(decision));
        assert!(found, "{decision} is not linked: {paths:?}");
    }
    assert!(checked_forms > 10, "{checked_forms} forms");
}

#[tokio::test]
async fn log_entries_link_to_their_kind_and_actor() {
    let site = Site::start().await;
    site.team("Alpha").await;
    let mut grace = grace(&site).await;
    let paused = [("reason", "a test")];
    redirect_target(&grace.submit("/organiser/decide/pause", &paused).await);
    let html = dashboard_page(&grace.open("/organiser/log").await, 200);
    let kind = links(&html, "a[href='/organiser/log?kind=queue_paused']").remove(0);
    let html = dashboard_page(&grace.open(&kind).await, 200);
    let rows = texts(&html, "tbody tr");
    assert_eq!(rows.len(), 1);
    assert!(
        rows[0].contains("Grace") && rows[0].contains("a test"),
        "{rows:?}"
    );
    let actor = links(&html, "a[href*='actor=person%3A']").remove(0);
    let html = dashboard_page(&grace.open(&actor).await, 200);
    assert!(
        texts(&html, "tbody tr")
            .iter()
            .all(|row| row.contains("Grace"))
    );
    let wrong = grace.open("/organiser/log?actor=unknown").await;
    let html = dashboard_page(&wrong, 422);
    assert!(texts(&html, "[role=alert]")[0].contains("expected organiser"));
}

#[tokio::test]
async fn first_steps_are_listed_until_the_season_runs() {
    let site = Site::start().await;
    let mut grace = grace(&site).await;
    let mut steps = async || {
        let html = dashboard_page(&grace.open("/organiser").await, 200);
        (
            texts(&html, ".checklist .done-step").len(),
            texts(&html, ".checklist li").len(),
            texts(&html, ".checklist strong").first().cloned(),
        )
    };
    // The season has a name, and its first stage is open.
    assert_eq!(steps().await, (2, 6, Some("Invite a team".to_owned())));
    let team = site.team("Alpha").await;
    let first = "Get the first valid submission".to_owned();
    assert_eq!(steps().await, (3, 6, Some(first)));
    site.valid_submission(&team, "agent").await;
    let day = "Start the first evaluation day".to_owned();
    assert_eq!(steps().await, (4, 6, Some(day)));
    site.start_day().await;
    let results = "See the first results on the board".to_owned();
    assert_eq!(steps().await, (5, 6, Some(results)));
    site.finish_evaluation(&result([0.5; 3], 10.0)).await;
    assert_eq!(steps().await, (0, 0, None));
}

#[tokio::test]
async fn log_is_sentences_with_names() {
    let site = Site::start().await;
    let [alpha, _] = [site.team("Alpha").await, site.team("Beta").await];
    site.valid_submission(&alpha, "agent").await;
    let mut grace = grace(&site).await;
    site.start_day().await;
    let disqualify = format!("/organiser/decide/disqualify/{}", alpha.id);
    let fields = [("reason", "it read the <b>seed</b>"), ("confirm", "Alpha")];
    redirect_target(&grace.submit(&disqualify, &fields).await);
    let html = dashboard_page(&grace.open("/organiser/log").await, 200);
    let rows = texts(&html, "tbody tr").join("\n");
    for sentence in [
        "Grace disqualified Alpha: it read the <b>seed</b>",
        "Grace joined as an organiser",
        "The operator created the team Beta",
        "Alpha’s submission valid: agent “agent”",
        "queued Alpha’s evaluation of 2026-03-01",
    ] {
        assert!(rows.contains(sentence), "{sentence} is not in {rows}");
    }
    let authors = texts(&html, "select[name=actor] option");
    assert!(authors.contains(&"Grace".to_owned()) && authors.contains(&"Alpha (team)".to_owned()));
}

#[tokio::test]
async fn stage_form_takes_times_in_the_stages_zone() {
    let site = Site::start().await;
    site.change_first_stage(json!({ "zone": "Asia/Tokyo", "closes_at": "2026-04-01T03:00:00Z" }))
        .await
        .json(200);
    let mut grace = grace(&site).await;
    let stage = site.stage().await;
    let path = format!("/organiser/stages/{stage}");
    let page = grace.open(&path).await;
    let html = dashboard_page(&page, 200);
    let label = texts(&html, "label[for=closes_at]").remove(0);
    assert!(label.contains("time zone Asia/Tokyo"), "{label}");
    let form = forms(&path, &page)
        .into_iter()
        .find(|form| form.is_post && form.action == path)
        .unwrap();
    let shown = ("closes_at".to_owned(), "2026-04-01T12:00".to_owned());
    assert!(form.fields.contains(&shown), "{form:?}");
    let fields: Vec<(&str, &str)> = form
        .fields
        .iter()
        .map(|(name, value)| match name.as_str() {
            "closes_at" => ("closes_at", "2026-04-02T12:00"),
            name => (name, value.as_str()),
        })
        .collect();
    let changed = grace.submit(&path, &fields).await;
    assert!(redirect_target(&changed).ends_with("done=stage-changed"));
    let view = site.get(&format!("/api/v1/stages/{stage}"), None).await;
    assert_eq!(view.json(200)["closes_at"], "2026-04-02T03:00:00Z");
}

#[tokio::test]
async fn announcement_sent_twice_is_published_once() {
    let site = Site::start().await;
    let mut grace = grace(&site).await;
    let news = [("title", "News"), ("text", "No day\r\non Sunday.")];
    for _ in 0..2 {
        let sent = grace.submit("/organiser/messages", &news).await;
        assert_eq!(redirect_target(&sent), "/organiser/messages?done=announced");
    }
    let all = site.get("/api/v1/announcements", None).await.json(200);
    assert_eq!(all.as_array().unwrap().len(), 1, "{all}");
}

#[tokio::test]
async fn day_has_one_primary_action() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "agent").await;
    let mut grace = grace(&site).await;
    let mut primary = async || {
        let html = dashboard_page(&grace.open("/organiser/day").await, 200);
        texts(&html, ".primary-action")
    };
    assert_eq!(primary().await, ["Start today’s evaluation day"]);
    let pause = json!({ "reason": "a test" });
    let paused = site.post("/api/v1/queue/pause", Some(ADMIN), &pause).await;
    assert_eq!(paused.status, 204);
    assert_eq!(primary().await, ["Resume the queue"]);
    let empty = json!({});
    let resumed = site.post("/api/v1/queue/resume", Some(ADMIN), &empty).await;
    assert_eq!(resumed.status, 204);
    site.start_day().await;
    assert!(primary().await.is_empty());
}
