//! Tests of the team dashboard (the pages below `/dashboard`) with a browser without scripts.

use crate::{
    browser::{Browser, PASSWORD, first_text, forms},
    html::{links, texts},
    site::{ADMIN, Answer, GZIP, MAX_BUNDLE_BYTES, Site, TestTeam, result, string},
};
use faceoff_airhockey::HIT;
use faceoff_types::{ValidationOutcome, ValidationTiming, ViolatedLimit, ViolationName};
use scraper::{Html, Selector};
use serde_json::json;

/// Parses a dashboard page. It must be valid, load only its two scripts, and have nothing inline.
#[track_caller]
pub fn dashboard_page(answer: &Answer, status: u16) -> Html {
    let html = answer.html(status);
    let scripts = Selector::parse("script").unwrap();
    let scripts: Vec<_> = html.select(&scripts).collect();
    let sources: Vec<_> = scripts
        .iter()
        .map(|script| {
            assert_eq!(script.text().collect::<String>(), "");
            let source = script.attr("src").unwrap();
            source.split('?').next().unwrap()
        })
        .collect();
    assert_eq!(sources, ["/static/dashboard.js", "/static/live.js"]);
    let policy = answer.header("content-security-policy");
    assert!(policy.contains("script-src 'self';") && !policy.contains("unsafe"));
    assert!(!answer.body.contains("style=") && !answer.body.contains("onclick"));
    html
}

/// The location of a redirect after a form.
#[track_caller]
pub fn redirect_target(answer: &Answer) -> String {
    assert_eq!(answer.status, 303, "{}", answer.body);
    answer.header("location").to_owned()
}

/// The browser of a new member of the team.
async fn member<'a>(site: &'a Site, team: &TestTeam, name: &str) -> Browser<'a> {
    let role = json!({ "role": "member", "team": team.id, "note": name });
    Browser::join(site, name, role).await
}

/// A successful validation run. The agent's name contains HTML, which pages must escape.
fn valid_outcome(log: &str) -> ValidationOutcome {
    ValidationOutcome::Valid {
        runtime: "native".into(),
        agent_name: "<b>striker</b>".into(),
        timing: vec![ValidationTiming {
            task: HIT,
            steps: 321,
            mean_s: 0.0005,
            p99_s: 0.00123,
            max_s: 0.015,
            points_per_episode: 0.5,
            episodes: 4,
            violations: vec![ViolatedLimit {
                limit: ViolationName::new("joint_vel"),
                episodes: 3,
            }],
        }],
        log: log.into(),
    }
}

#[tokio::test]
async fn member_uploads_and_selects_the_active_submission() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let mut ada = member(&site, &team, "Ada").await;
    let empty = dashboard_page(&ada.open("/dashboard").await, 200);
    assert_eq!(texts(&empty, "h1"), ["Alpha"]);
    assert!(texts(&empty, "[data-live-section=submissions]")[0].contains("None yet"));
    assert!(texts(&empty, "[data-live-section=next]")[0].contains("None: upload a bundle"));

    let sent = ada
        .upload("/dashboard/upload", "striker.tar.gz", &GZIP)
        .await;
    assert_eq!(
        (sent.status.as_u16(), sent.header("location")),
        (303, "/dashboard?done=uploaded")
    );
    let html = dashboard_page(&ada.open("/dashboard?done=uploaded").await, 200);
    assert!(texts(&html, "[role=status]")[0].starts_with("Uploaded."));
    assert_eq!(texts(&html, ".entry .state"), ["validating"]);
    assert_eq!(
        texts(&html, "[data-in-progress]").len(),
        1,
        "the page's script follows the validation run"
    );
    let log = site
        .get("/api/v1/events?limit=1", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(log["events"][0]["actor_name"], "Ada", "{log}");

    site.finish_validation(valid_outcome("ready\n<i>on</i>\n"))
        .await;
    let html = dashboard_page(&ada.open("/dashboard").await, 200);
    assert_eq!(
        texts(&html, ".entry .state"),
        ["valid", "active at the next cutoff"]
    );
    assert!(texts(&html, "[data-live-section=next]")[0].contains("<b>striker</b>"));
    let page = links(&html, ".entry h3 a").remove(0);
    let html = dashboard_page(&ada.open(&page).await, 200);
    assert_eq!(texts(&html, "h1"), ["<b>striker</b>"]);
    assert_eq!(texts(&html, "pre"), ["ready <i>on</i>"]);
    assert_eq!(
        texts(&html, "[data-live-section=verdict] tbody td"),
        // Steps, mean, 99th percentile and maximum in ms, penalty points per episode, and violated limits.
        [
            "321",
            "0.50",
            "1.23",
            "15.00",
            "0.5",
            "joint velocity in 3 of 4 episodes"
        ]
    );

    // The newest valid submission is active; an older one can be selected.
    ada.upload("/dashboard/upload", "second.zip", b"PK\x03\x04\x14\x00")
        .await;
    site.finish_validation(valid_outcome("")).await;
    let html = dashboard_page(&ada.open("/dashboard").await, 200);
    assert_eq!(texts(&html, ".entry[aria-current] .note").len(), 1);
    let activated = ada.submit(&format!("{page}/activate"), &[]).await;
    assert_eq!(activated.header("location"), "/dashboard?done=activated");
    let html = dashboard_page(&ada.open("/dashboard?done=activated").await, 200);
    assert_eq!(links(&html, ".entry[aria-current] h3 a").join(" "), page);
    let withdrawn = ada.submit(&format!("{page}/withdraw"), &[]).await;
    assert_eq!(withdrawn.header("location"), "/dashboard?done=withdrawn");
    let html = dashboard_page(&ada.open("/dashboard").await, 200);
    assert!(links(&html, ".entry[aria-current] h3 a").is_empty());
    // A second withdrawal is refused as in the API, and the page is shown with the error.
    let twice = ada.submit(&format!("{page}/withdraw"), &[]).await;
    let html = dashboard_page(&twice, 409);
    assert!(
        texts(&html, "[role=alert]")[0].contains("withdrawn"),
        "{}",
        twice.body
    );

    let words = [("label", "Fast one"), ("note", "two\r\nlines")];
    let described = ada.submit(&format!("{page}/describe"), &words).await;
    assert_eq!(
        described.header("location"),
        format!("{page}?done=described")
    );
    let html = dashboard_page(&ada.open(&page).await, 200);
    assert_eq!(texts(&html, "h1"), ["Fast one"]);
    let long = "x".repeat(81);
    let refused = ada
        .submit(
            &format!("{page}/describe"),
            &[("label", &long), ("note", "kept")],
        )
        .await;
    let html = dashboard_page(&refused, 422);
    assert!(texts(&html, "[role=alert]")[0].contains("1 to 80 characters"));
    assert_eq!(texts(&html, "textarea"), ["kept"]);
}

#[tokio::test]
async fn invalid_archive_is_refused_on_the_page() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let mut ada = member(&site, &team, "Ada").await;
    let large = [&GZIP[..], &vec![0; MAX_BUNDLE_BYTES as usize]].concat();
    for (file_name, bundle, status, words) in [
        ("large.tar.gz", large.as_slice(), 413, "at most 65536 bytes"),
        (
            "notes.txt",
            b"not an archive".as_slice(),
            415,
            "Expected a .tar.gz",
        ),
        ("empty.zip", b"".as_slice(), 400, "got an empty body"),
        ("", b"".as_slice(), 400, "No file was chosen"),
    ] {
        let refused = ada.upload("/dashboard/upload", file_name, bundle).await;
        let html = dashboard_page(&refused, status);
        let alert = &texts(&html, "[role=alert]")[0];
        assert!(alert.contains(words), "{alert}");
        assert_eq!(
            texts(&html, "form[data-upload]").len(),
            1,
            "the form is shown again"
        );
    }
    // A bundle of exactly the maximum size is accepted.
    let largest = [&GZIP[..], &vec![0; MAX_BUNDLE_BYTES as usize - GZIP.len()]].concat();
    assert_eq!(
        ada.upload("/dashboard/upload", "most.tgz", &largest)
            .await
            .status,
        303
    );
    let stored = site.get("/api/v1/submissions", Some(&team.token)).await;
    let stored = stored.json(200);
    assert_eq!(stored.as_array().unwrap().len(), 1, "{stored}");
    assert_eq!(
        (stored[0]["bytes"].as_u64(), string(&stored[0]["file_name"])),
        (Some(MAX_BUNDLE_BYTES), "most.tgz".into())
    );
    let hash = blake3::hash(&largest).to_string();
    assert_eq!(
        string(&stored[0]["blake3"]),
        hash,
        "only the file is stored, without the multipart framing"
    );
}

#[tokio::test]
async fn visitor_is_redirected_to_sign_in_and_back() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    drop(member(&site, &team, "Ada").await);
    let mut browser = Browser::new(&site);
    for (path, next) in [
        ("/dashboard", "%2Fdashboard"),
        ("/dashboard/access?x=1", "%2Fdashboard%2Faccess%3Fx%3D1"),
        ("/organiser/day", "%2Forganiser%2Fday"),
    ] {
        let redirected = browser.open(path).await;
        assert_eq!(redirected.status, 303);
        assert_eq!(
            redirected.header("location"),
            format!("/sign-in?next={next}")
        );
    }
    // What was typed into a form is kept; a form without texts leads back to the dashboard.
    let sent = browser
        .submit("/dashboard/access/tokens", &[("name", "a")])
        .await;
    assert_eq!(sent.status, 401);
    let sent = browser
        .submit("/dashboard/access/tokens", &[("name", "")])
        .await;
    assert_eq!(sent.header("location"), "/sign-in?next=%2Fdashboard");
    let sent = browser.upload("/dashboard/upload", "a.zip", &GZIP).await;
    assert_eq!(sent.header("location"), "/sign-in?next=%2Fdashboard");

    let page = browser.open("/sign-in?next=%2Fdashboard%2Faccess").await;
    let form = forms("/sign-in", &page).remove(0);
    let next = ("next".to_owned(), "/dashboard/access".to_owned());
    assert!(form.fields.contains(&next), "{form:?}");
    let fields = [
        ("name", "Ada"),
        ("password", PASSWORD),
        ("next", "/dashboard/access"),
    ];
    let signed_in = browser.submit("/sign-in", &fields).await;
    assert_eq!(signed_in.header("location"), "/dashboard/access");
    // Redirects to other sites are refused.
    let foreign = browser
        .open("/sign-in?next=https%3A%2F%2Fevil.example")
        .await;
    assert!(!foreign.body.contains("evil"));
    for evil in [
        "//evil.example",
        "https://evil.example/dashboard",
        "/dashboard\\..\\x",
    ] {
        let fields = [fields[0], fields[1], ("next", evil)];
        let signed_in = browser.submit("/sign-in", &fields).await;
        assert_eq!(signed_in.header("location"), "/dashboard");
    }
}

#[tokio::test]
async fn old_dashboard_address_redirects_permanently() {
    let site = Site::start().await;
    let mut browser = Browser::new(&site);
    for (old, new) in [
        ("/desk", "/dashboard"),
        ("/desk?done=uploaded", "/dashboard?done=uploaded"),
        ("/desk/submissions/x", "/dashboard/submissions/x"),
        ("/desk/access?a=b%26c", "/dashboard/access?a=b%26c"),
    ] {
        let redirected = browser.open(old).await;
        assert_eq!(redirected.status, 308, "{old}");
        assert_eq!(redirected.header("location"), new);
    }
    // Status 308 makes a browser send the form again, with its method and body.
    let form = browser
        .submit("/desk/questions", &[("text", "When?")])
        .await;
    assert_eq!(form.status, 308);
    assert_eq!(form.header("location"), "/dashboard/questions");
}

#[tokio::test]
async fn token_is_shown_once_and_can_be_revoked() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let mut ada = member(&site, &team, "Ada").await;
    let fields = [("name", "CI"), ("owner", "team"), ("days", "30")];
    let created = ada.submit("/dashboard/access/tokens", &fields).await;
    let html = dashboard_page(&created, 201);
    let secret = texts(&html, ".secret code").remove(0);
    let me = site.get("/api/v1/whoami", Some(&secret)).await.json(200);
    assert_eq!(me["role"], "team");
    assert_eq!(me["token"]["expires_at"], "2026-03-31T10:00:00Z");
    let page = ada.open("/dashboard/access").await;
    dashboard_page(&page, 200);
    assert!(!page.body.contains(&secret), "the secret is shown once");
    let id = string(&me["token"]["id"]);
    let revoked = ada
        .submit(&format!("/dashboard/access/tokens/{id}/revoke"), &[])
        .await;
    assert_eq!(revoked.header("location"), "/dashboard/access?done=revoked");
    assert_eq!(site.get("/api/v1/whoami", Some(&secret)).await.status, 401);
    let nameless = [("name", " "), ("owner", "me"), ("days", "")];
    let refused = dashboard_page(
        &ada.submit("/dashboard/access/tokens", &nameless).await,
        422,
    );
    assert!(texts(&refused, "[role=alert]")[0].contains("1 to 80 characters"));
    // A token of the member, without an expiry.
    let fields = [("name", "mine"), ("owner", "me"), ("days", "")];
    let created = ada.submit("/dashboard/access/tokens", &fields).await;
    let secret = texts(&dashboard_page(&created, 201), ".secret code").remove(0);
    let me = site.get("/api/v1/whoami", Some(&secret)).await.json(200);
    assert_eq!(
        (&me["role"], &me["token"]["expires_at"]),
        (&json!("member"), &json!(null))
    );
}

#[tokio::test]
async fn member_invites_revokes_an_invitation_and_leaves() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let mut ada = member(&site, &team, "Ada").await;
    let created = ada
        .submit("/dashboard/access/invitations", &[("note", "Ben")])
        .await;
    let link = texts(&dashboard_page(&created, 201), ".secret code").remove(0);
    let link = link
        .strip_prefix(&site.url)
        .unwrap_or_else(|| panic!("{link}"))
        .to_owned();
    let mut ben = Browser::new(&site);
    let fields = [("name", "Ben"), ("password", PASSWORD)];
    assert_eq!(ben.submit(&link, &fields).await.status, 303);
    let html = dashboard_page(&ada.open("/dashboard/access").await, 200);
    assert_eq!(
        texts(&html, "section[aria-labelledby=people] tbody th"),
        ["Ada you", "Ben"]
    );
    let created = ada
        .submit("/dashboard/access/invitations", &[("note", "Eve")])
        .await;
    let link = texts(&dashboard_page(&created, 201), ".secret code").remove(0);
    let link = link
        .strip_prefix(&site.url)
        .unwrap_or_else(|| panic!("{link}"))
        .to_owned();
    let listed = forms("/dashboard/access", &ada.open("/dashboard/access").await);
    let revoke_form = listed
        .iter()
        .find(|form| form.action.contains("/invitations/"))
        .unwrap();
    let revoked = ada.submit(&revoke_form.action, &[]).await;
    assert_eq!(
        revoked.header("location"),
        "/dashboard/access?done=uninvited"
    );
    let eve = Browser::new(&site)
        .submit(&link, &[("name", "Eve"), ("password", PASSWORD)])
        .await;
    assert_eq!(eve.status, 409);
    // Members cannot remove each other, but can leave by confirming their own name.
    let users = site.get("/api/v1/people", Some(ADMIN)).await.json(200);
    let id = |name: &str| {
        let mut users = users.as_array().unwrap().iter();
        string(&users.find(|user| user["name"] == name).unwrap()["id"])
    };
    let remove = |name: &str| format!("/dashboard/access/people/{}/remove", id(name));
    let refused = ada.submit(&remove("Ben"), &[("confirm", "Ben")]).await;
    assert_eq!(refused.status, 403);
    let wrong = ben.submit(&remove("Ben"), &[("confirm", "Ada")]).await;
    assert!(first_text(&wrong, "[role=alert]").contains("Nothing is done yet"));
    let left = ben.submit(&remove("Ben"), &[("confirm", "Ben")]).await;
    assert_eq!(left.status, 303);
    assert_eq!(
        ben.open("/dashboard").await.status,
        303,
        "redirected to sign in"
    );
}

#[tokio::test]
async fn submission_of_another_team_is_not_found() {
    let site = Site::start().await;
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let path = site.valid_submission(&beta, "agent").await;
    let path = path.replace("/api/v1", "/dashboard");
    let mut ada = member(&site, &alpha, "Ada").await;
    assert_eq!(ada.open(&path).await.status, 404);
    for action in ["activate", "withdraw", "describe"] {
        let fields = [("label", "mine"), ("note", "")];
        let refused = ada.submit(&format!("{path}/{action}"), &fields).await;
        assert_eq!(refused.status, 404, "{action}: {}", refused.body);
    }
    assert_eq!(ada.open("/dashboard/submissions/none").await.status, 404);
    let mut ben = member(&site, &beta, "Ben").await;
    let html = dashboard_page(&ben.open("/dashboard").await, 200);
    assert_eq!(
        texts(&html, ".entry .state").len(),
        2,
        "the submission is valid and still active"
    );
}

#[tokio::test]
async fn dashboard_forms_refuse_foreign_origins() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "agent").await;
    let terms = json!({ "text": "Be fair." });
    let mut ada = member(&site, &team, "Ada").await;
    site.post("/api/v1/terms", Some(ADMIN), &terms)
        .await
        .json(201);
    ada.submit("/dashboard/access/invitations", &[("note", "Ben")])
        .await;
    ada.submit("/dashboard/access/tokens", &[("name", "CI")])
        .await;
    let first_page = dashboard_page(&ada.open("/dashboard").await, 200);
    let submission = links(&first_page, ".entry h3 a").remove(0);
    let mut actions = Vec::new();
    for path in [
        "/dashboard",
        submission.as_str(),
        "/dashboard/questions",
        "/dashboard/access",
    ] {
        let page = ada.open(path).await;
        dashboard_page(&page, 200);
        for form in forms(path, &page).into_iter().filter(|form| form.is_post) {
            let before = site.get("/api/v1/events?limit=1", Some(ADMIN)).await;
            for answer in ada.submit_from_foreign_page(&form).await {
                assert_eq!(answer.status, 403, "{form:?}: {}", answer.body);
            }
            let after = site.get("/api/v1/events?limit=1", Some(ADMIN)).await;
            assert_eq!(before.body, after.body, "{form:?} changed something");
            actions.push(form.action);
        }
    }
    for expected in [
        "/dashboard/upload",
        "/dashboard/terms",
        "/withdraw",
        "/describe",
        "/questions",
        "/access/tokens",
        "/access/invitations",
        "/revoke",
        "/remove",
        "/sign-out",
    ] {
        let found = actions.iter().any(|action| action.ends_with(expected));
        assert!(found, "{expected} is not among {actions:?}");
    }
    let accepted = ada.submit("/dashboard/terms", &[("version", "1")]).await;
    assert_eq!(accepted.header("location"), "/dashboard?done=terms");
    let body = ada.open("/dashboard").await.body;
    assert!(!body.contains("Terms to accept"));
}

#[tokio::test]
async fn dashboard_lists_evaluations_with_their_files() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "agent").await;
    site.start_day().await;
    site.finish_evaluation(&result([0.5; 3], 100.0)).await;
    let mut ada = member(&site, &team, "Ada").await;
    let html = dashboard_page(&ada.open("/dashboard").await, 200);
    let row = texts(&html, "section[aria-labelledby=evaluations] tbody tr").remove(0);
    assert!(row.starts_with("2026-03-01finished 50.0"), "{row}");
    let dataset = links(&html, "a[href$='/dataset']").remove(0);
    assert_eq!(
        ada.open(&dataset).await.status,
        200,
        "authenticated by the session"
    );
    let bundle = links(&html, "a[href$='/bundle']").remove(0);
    assert_eq!(ada.open(&bundle).await.status, 200);
}

#[tokio::test]
async fn dashboard_shows_rank_tasks_and_next_cutoff() {
    let site = Site::start_with_schedule("12:00").await;
    site.add_ranked_teams(&[
        ("Alpha", result([0.9; 3], 10.0)),
        ("Beta", result([0.5, 0.25, 0.0], 10.0)),
    ])
    .await;
    let teams = site.get("/api/v1/teams", Some(ADMIN)).await.json(200);
    let beta = teams.as_array().unwrap().iter();
    let beta = beta.clone().find(|team| team["name"] == "Beta").unwrap();
    let role = json!({ "role": "member", "team": beta["id"], "note": "Ben" });
    let mut ben = Browser::join(&site, "Ben", role).await;
    let html = dashboard_page(&ben.open("/dashboard").await, 200);
    let tiles = texts(&html, "section[aria-labelledby=result] .tiles dd");
    // As on the board, since chance may have made the difference.
    assert_eq!(tiles[0], "1= of 2");
    let tasks = texts(&html, ".task-bars dd .figure");
    assert_eq!(tasks, ["50.0 %", "25.0 %", "0.0 %"]);
    let bars = Selector::parse(".task-bars svg.bar").unwrap();
    assert_eq!(html.select(&bars).count(), 3);
    let countdown = Selector::parse("[data-countdown]").unwrap();
    let countdown = html.select(&countdown).next().unwrap();
    let at: jiff::Timestamp = countdown.attr("data-countdown").unwrap().parse().unwrap();
    assert!(at > site.now());
    let text: String = countdown.text().collect();
    assert!(text.starts_with("in "), "{text}");
    assert!(texts(&html, ".failed-episodes").is_empty(), "no replays");
}

#[tokio::test]
async fn member_changes_password_and_team() {
    const NEW_PASSWORD: &str = "a whole new password";
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let mut ada = member(&site, &team, "Ada").await;
    let page = dashboard_page(&ada.open("/dashboard/settings").await, 200);
    assert_eq!(texts(&page, "h2"), ["Your name", "Password", "Team"]);
    let set = async |ada: &mut Browser<'_>, old: &str, new: &str| {
        let fields = [("old_password", old), ("new_password", new)];
        ada.submit("/dashboard/settings/password", &fields).await
    };
    let wrong = set(&mut ada, "wrong", NEW_PASSWORD).await;
    assert!(first_text(&wrong, "[role=alert]").contains("expected the current password"));
    assert!(!wrong.body.contains(NEW_PASSWORD));
    dashboard_page(&set(&mut ada, PASSWORD, "short").await, 422);
    let changed = set(&mut ada, PASSWORD, NEW_PASSWORD).await;
    assert_eq!(
        redirect_target(&changed),
        "/dashboard/settings?done=password-set"
    );
    let mut other = Browser::new(&site);
    let sign_in = |password| [("name", "Ada"), ("password", password)];
    let old = other.submit("/sign-in", &sign_in(PASSWORD)).await;
    assert_eq!(old.status, 401);
    let new = other.submit("/sign-in", &sign_in(NEW_PASSWORD)).await;
    assert_eq!(redirect_target(&new), "/dashboard");

    let fields = [
        ("team_name", "Alpha Two"),
        ("affiliation", "TU"),
        ("link", ""),
    ];
    let renamed = ada.submit("/dashboard/settings/team", &fields).await;
    assert_eq!(
        redirect_target(&renamed),
        "/dashboard/settings?done=team-changed"
    );
    let view = site.get(&format!("/api/v1/teams/{}", team.id), None).await;
    let view = view.json(200);
    assert_eq!(
        (&view["name"], &view["affiliation"]),
        (&json!("Alpha Two"), &json!("TU"))
    );
    let fields = [fields[0], fields[1], ("link", "ftp://x")];
    let refused = ada.submit("/dashboard/settings/team", &fields).await;
    let html = dashboard_page(&refused, 422);
    assert!(texts(&html, "[role=alert]")[0].contains("https://"));
    assert!(
        refused.body.contains("value=\"ftp://x\""),
        "the form is kept"
    );
}

#[tokio::test]
async fn member_changes_own_name_and_signs_in_with_it() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let mut ada = member(&site, &team, "Ada").await;
    let _ = member(&site, &team, "Eve").await;
    for (name, status, expected) in [
        ("eve", 409, "Eve"),
        ("<b>", 422, "Your name"),
        ("", 422, "Your name"),
    ] {
        let fields = [("user_name", name)];
        let refused = ada.submit("/dashboard/settings/name", &fields).await;
        let html = dashboard_page(&refused, status);
        let alert = first_text(&refused, "[role=alert]");
        assert!(alert.contains(expected), "{alert}");
        let field = Selector::parse("#user_name").unwrap();
        let typed = html.select(&field).next().unwrap().attr("value");
        assert_eq!(typed, Some(name), "the form is kept");
    }
    let fields = [("user_name", " Ada Lovelace ")];
    let renamed = ada.submit("/dashboard/settings/name", &fields).await;
    let target = redirect_target(&renamed).to_owned();
    assert_eq!(target, "/dashboard/settings?done=user-renamed");
    let page = dashboard_page(&ada.open(&target).await, 200);
    assert!(texts(&page, "[role=status]")[0].contains("Sign in with it"));
    let mut other = Browser::new(&site);
    for (name, signed_in) in [("Ada", false), ("Ada Lovelace", true)] {
        let fields = [("name", name), ("password", PASSWORD)];
        let answer = other.submit("/sign-in", &fields).await;
        assert_eq!(answer.status == 303, signed_in, "{name}");
    }
    let events = "/api/v1/events?kind=person_renamed";
    let events = site.get(events, Some(ADMIN)).await.json(200);
    let names = json!({ "from": "Ada", "to": "Ada Lovelace" });
    assert_eq!(events["events"][0]["details"], names);
}

#[tokio::test]
async fn question_sent_twice_is_asked_once() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let mut ada = member(&site, &team, "Ada").await;
    for text in ["When\r\nis it?", "When\r\nis it?", "Where?"] {
        let asked = ada.submit("/dashboard/questions", &[("text", text)]).await;
        assert_eq!(redirect_target(&asked), "/dashboard/questions?done=asked");
    }
    let questions = site.get("/api/v1/questions", Some(ADMIN)).await.json(200);
    assert_eq!(questions.as_array().unwrap().len(), 2, "{questions}");
}
