//! Webhooks, with a receiver on a real port that checks signatures by itself.

use crate::{
    receiver::{Behaves, Receiver},
    site::{ADMIN, Answer, Site, TestTeam, result, text},
};
use faceoff_notify::{Deliverer, WebhookRules};
use reqwest::Method;
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

/// Which lets this host be told.
fn here() -> WebhookRules {
    WebhookRules {
        enabled: true,
        allow_http: true,
        ports: Vec::new(),
        allow_private: vec!["127.0.0.0/8".parse().unwrap()],
    }
}

fn deliverer(site: &Site, rules: WebhookRules) -> Deliverer {
    Deliverer::new(
        site.store.clone(),
        site.clock(),
        rules,
        crate::site::no_tls(),
    )
    .unwrap()
}

async fn deliver(site: &Site) {
    deliverer(site, here()).deliver_due().await.unwrap();
}

async fn member(site: &Site, team: &TestTeam, name: &str) -> String {
    let invited = json!({ "role": "member", "team": team.id, "note": name });
    let path = "/api/v1/invitations";
    let made = site.post(path, Some(ADMIN), &invited).await.json(201);
    let join = json!({ "code": made["code"], "name": name });
    let path = "/api/v1/invitations/accept";
    text(&site.post(path, None, &join).await.json(201)["secret"])
}

/// A webhook: its path and its secret.
async fn hook(site: &Site, token: &str, url: &str, about: &[&str]) -> (String, String) {
    let new = json!({ "name": "ours", "url": url, "about": about });
    let made = site.post("/api/v1/webhooks", Some(token), &new).await;
    let made = made.json(201);
    let secret = text(&made["secret"]);
    assert!(secret.starts_with("whsec_"));
    (format!("/api/v1/webhooks/{}", text(&made["id"])), secret)
}

async fn announce(site: &Site) {
    let told = json!({ "title": "News", "text": "of this test" });
    let path = "/api/v1/announcements";
    site.post(path, Some(ADMIN), &told).await.json(201);
}

async fn patch(site: &Site, path: &str, token: &str, body: Value) -> Answer {
    let request = site.request(Method::PATCH, path, Some(token)).json(&body);
    Answer::of(request.send().await.unwrap()).await
}

async fn deliveries(site: &Site, path: &str) -> Vec<Value> {
    let path = format!("{path}/deliveries");
    let deliveries = site.get(&path, Some(ADMIN)).await.json(200);
    deliveries.as_array().unwrap().clone()
}

#[tokio::test]
async fn a_team_is_told_what_concerns_it_and_organisers_are_told_all() {
    let site = Site::start().await;
    let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
    let ada = member(&site, &alpha, "Ada").await;
    let (ours, all) = (Receiver::start().await, Receiver::start().await);
    let (path, secret) = hook(&site, &ada, &ours.url, &[]).await;
    hook(&site, ADMIN, &all.url, &["evaluations", "submissions"]).await;
    let of_alpha = site.valid_submission(&alpha, "a").await;
    site.valid_submission(&beta, "b").await;
    site.evaluate(&alpha, &of_alpha).await;
    site.finish(&result([0.511; 3], 777.5)).await;
    site.finish(&result([0.7; 3], 20.0)).await;
    deliver(&site).await;

    let types = ours.types();
    assert!(!types.contains(&"webhook_rotated".to_owned()));
    for kind in ["submission_valid", "day_started", "day_released"] {
        let told = types.iter().filter(|found| *found == kind).count();
        assert_eq!(told, 1, "{kind} in {types:?}");
    }
    let finished = types.iter().filter(|kind| *kind == "evaluation_finished");
    assert_eq!(finished.count(), 2, "boards show both");
    let mut events = Vec::new();
    for got in ours.got() {
        assert!(got.is_signed_by(&secret));
        assert!(!got.is_signed_by("whsec_AAAA"));
        assert_eq!(got.timestamp, site.now().as_second().to_string());
        assert!(!got.body.contains("51.1"), "no score: {}", got.body);
        let body = got.json();
        assert_eq!(body["type"], body["data"]["kind"]);
        assert_eq!(body["timestamp"], body["data"]["at"]);
        events.push(body["data"]["id"].as_i64().unwrap());
    }
    let known = events.len();
    events.sort_unstable();
    events.dedup();
    assert_eq!(events.len(), known, "each once");
    let told = all.types();
    for (kind, times) in [("submission_uploaded", 2), ("evaluation_queued", 2)] {
        let found = told.iter().filter(|found| *found == kind).count();
        assert_eq!(found, times, "{told:?}");
    }
    assert!(!told.contains(&"day_started".to_owned()), "not asked for");

    // Everything was taken, and nothing is sent twice.
    deliver(&site).await;
    assert_eq!(ours.got().len(), known);
    let shown = deliveries(&site, &path).await;
    assert_eq!(shown.len(), known);
    assert!(shown.iter().all(|one| one["state"] == "delivered"));
    assert_eq!(shown[0]["last"]["status"], 204);
    site.later(15 * 24 * 3600);
    let forgotten = site.store.forget_deliveries(site.now()).await.unwrap();
    assert!(forgotten as usize >= known);
    assert_eq!(deliveries(&site, &path).await.len(), 0);
}

#[tokio::test]
async fn what_was_not_taken_is_sent_again_later_and_at_last_given_up() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, _) = hook(&site, ADMIN, &receiver.url, &["announced"]).await;
    receiver.behaves(&[Behaves::Answers(500)]);
    announce(&site).await;
    deliver(&site).await;
    deliver(&site).await;
    assert_eq!(receiver.got().len(), 1, "not before its time");
    let view = site.get(&path, Some(ADMIN)).await.json(200);
    assert_eq!(view["state"], "failing");
    assert_eq!(view["since"], site.now().to_string());
    let waiting = &deliveries(&site, &path).await[0];
    assert_eq!(waiting["state"], "waiting");
    assert_eq!(waiting["last"]["status"], 500);
    assert_eq!(
        waiting["last"]["error"],
        "it answered 500, expected 200 to 299"
    );
    let next: jiff::Timestamp = text(&waiting["next_at"]).parse().unwrap();
    assert!((5..=6).contains(&next.duration_since(site.now()).as_secs()));

    site.turn_to(next);
    deliver(&site).await;
    let got = receiver.got();
    assert_eq!(got.len(), 2);
    assert_eq!((&got[0].id, &got[0].body), (&got[1].id, &got[1].body));
    assert_ne!(got[0].timestamp, got[1].timestamp);
    let view = site.get(&path, Some(ADMIN)).await.json(200);
    assert_eq!(view["state"], "alive");

    // One that nobody takes.
    receiver.behaves(&[Behaves::Answers(404); 7]);
    announce(&site).await;
    for _ in 0..7 {
        deliver(&site).await;
        site.later(13 * 3600);
    }
    deliver(&site).await;
    assert_eq!(receiver.got().len(), 2 + 7);
    let given_up = &deliveries(&site, &path).await[0];
    assert_eq!(given_up["state"], "given_up");
    assert_eq!(given_up["attempts"], 7);
}

#[tokio::test]
async fn for_a_day_both_secrets_sign() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha, "Ada").await;
    let receiver = Receiver::start().await;
    let (path, old) = hook(&site, &ada, &receiver.url, &["announced"]).await;
    let rotate = format!("{path}/rotate");
    site.post(&rotate, Some(ADMIN), &json!({}))
        .await
        .problem(403, "forbidden", &["members"]);
    let rotated = site.post(&rotate, Some(&ada), &json!({})).await.json(200);
    let new = text(&rotated["secret"]);
    assert_ne!(old, new);
    announce(&site).await;
    deliver(&site).await;
    let both = &receiver.got()[0];
    assert!(both.is_signed_by(&old) && both.is_signed_by(&new));
    site.later(24 * 3600);
    announce(&site).await;
    deliver(&site).await;
    let one = &receiver.got()[1];
    assert!(!one.is_signed_by(&old) && one.is_signed_by(&new));
    let view = site.get(&path, Some(&ada)).await;
    assert!(!view.body.contains("secret"), "{}", view.body);
}

#[tokio::test]
async fn who_wants_nothing_any_more_is_left_alone_until_it_is_revived() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha, "Ada").await;
    let receiver = Receiver::start().await;
    let (path, _) = hook(&site, &ada, &receiver.url, &["announced"]).await;
    receiver.behaves(&[Behaves::Answers(410)]);
    announce(&site).await;
    deliver(&site).await;
    let dead = site.get(&path, Some(&ada)).await.json(200);
    assert_eq!(dead["state"], "dead");
    assert!(text(&dead["reason"]).contains("410"));
    let log = "/api/v1/events?kind=webhook_died";
    let log = site.get(log, Some(ADMIN)).await.json(200);
    assert_eq!(log["events"][0]["subject"], format!("team:{}", alpha.id));
    announce(&site).await;
    site.later(3600);
    deliver(&site).await;
    assert_eq!(receiver.got().len(), 1);
    let test = format!("{path}/test");
    site.post(&test, Some(&ada), &json!({}))
        .await
        .problem(409, "conflict", &["revive"]);

    let revived = patch(&site, &path, &ada, json!({ "state": "alive" })).await;
    assert_eq!(revived.json(200)["state"], "alive");
    announce(&site).await;
    deliver(&site).await;
    assert_eq!(receiver.got().len(), 2, "of what happens from now on");
}

#[tokio::test]
async fn who_takes_nothing_for_three_days_is_dead() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, _) = hook(&site, ADMIN, &receiver.url, &["announced"]).await;
    receiver.behaves(&[Behaves::Answers(503); 40]);
    for _ in 0..72 {
        assert_eq!(
            site.get(&path, Some(ADMIN)).await.json(200)["id"],
            path[17..]
        );
        announce(&site).await;
        deliver(&site).await;
        site.later(3600);
        receiver.behaves(&[Behaves::Answers(503); 40]);
    }
    let mut view = site.get(&path, Some(ADMIN)).await.json(200);
    assert_eq!(view["state"], "failing");
    // It dies by a message that is given up; when that is depends on pauses that are drawn.
    for _ in 0..48 {
        deliver(&site).await;
        view = site.get(&path, Some(ADMIN)).await.json(200);
        if view["state"] == "dead" {
            break;
        }
        site.later(3600);
        receiver.behaves(&[Behaves::Answers(503); 40]);
    }
    assert_eq!(view["state"], "dead");
    assert!(text(&view["reason"]).contains("72 hours"), "{view}");
    assert!(text(&view["reason"]).contains("503"), "{view}");
}

#[tokio::test]
async fn a_redirect_is_not_followed_and_what_is_answered_is_shown_to_nobody() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, _) = hook(&site, ADMIN, &receiver.url, &["announced"]).await;
    receiver.behaves(&[Behaves::Redirects, Behaves::Answers(418)]);
    announce(&site).await;
    deliver(&site).await;
    let redirected = &deliveries(&site, &path).await[0];
    assert_eq!(redirected["last"]["status"], 302);
    assert!(text(&redirected["last"]["error"]).contains("redirects are not followed"));
    site.later(10);
    deliver(&site).await;
    assert_eq!(receiver.got().len(), 2);
    let shown = site.get(&format!("{path}/deliveries"), Some(ADMIN)).await;
    assert!(shown.body.contains("418"));
    assert!(!shown.body.contains("what is told here"), "{}", shown.body);
}

#[tokio::test]
async fn nothing_is_sent_to_addresses_that_are_not_public() {
    let site = Site::start().await;
    for (url, words) in [
        ("http://10.0.0.1/", "private network"),
        ("http://169.254.169.254/latest/meta-data", "link-local"),
        ("http://[::1]/", "loopback"),
        ("ftp://example.org/", "https://"),
        ("nowhere", "https://example.org"),
    ] {
        let new = json!({ "name": "ours", "url": url });
        let answer = site.post("/api/v1/webhooks", Some(ADMIN), &new).await;
        answer.problem(422, "invalid-content", &["url", words]);
    }
    // Which address a name leads to is seen when something is sent.
    let receiver = Receiver::start().await;
    let by_name = format!("http://localhost:{}/hook", receiver.port);
    let (path, _) = hook(&site, ADMIN, &by_name, &["announced"]).await;
    let (literal, _) = hook(&site, ADMIN, &receiver.url, &["announced"]).await;
    announce(&site).await;
    let strict = WebhookRules {
        enabled: true,
        allow_private: Vec::new(),
        ..here()
    };
    deliverer(&site, strict).deliver_due().await.unwrap();
    assert_eq!(receiver.got().len(), 0);
    for path in [&path, &literal] {
        let refused = &deliveries(&site, path).await[0];
        assert_eq!(refused["last"]["status"], Value::Null);
        let error = text(&refused["last"]["error"]);
        assert!(error.contains("loopback"), "{error}");
    }
}

#[tokio::test]
async fn what_was_sent_and_not_noted_is_sent_again_by_the_same_id() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, secret) = hook(&site, ADMIN, &receiver.url, &["announced"]).await;
    receiver.behaves(&[Behaves::Hangs]);
    announce(&site).await;
    let killed = deliverer(&site, here());
    let killed = tokio::spawn(async move { killed.deliver_due().await });
    receiver.comes(1).await;
    killed.abort();
    assert!(killed.await.unwrap_err().is_cancelled());
    assert_eq!(deliveries(&site, &path).await[0]["attempts"], 0);
    deliver(&site).await;
    let got = receiver.got();
    assert_eq!(got.len(), 2);
    assert_eq!((&got[0].id, &got[0].body), (&got[1].id, &got[1].body));
    assert!(got[1].is_signed_by(&secret));
    assert_eq!(deliveries(&site, &path).await.len(), 1);
}

#[tokio::test]
async fn a_running_server_tells_at_once_and_ends_when_it_is_asked_to() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, secret) = hook(&site, ADMIN, &receiver.url, &["announced"]).await;
    let shutdown = CancellationToken::new();
    let running = tokio::spawn(deliverer(&site, here()).run(shutdown.clone()));
    announce(&site).await;
    assert_eq!(receiver.comes(1).await[0].json()["type"], "announced");
    let test = format!("{path}/test");
    let queued = site.post(&test, Some(ADMIN), &json!({})).await.json(202);
    let got = receiver.comes(2).await;
    assert_eq!(got[1].id, text(&queued["id"]));
    assert_eq!(got[1].json()["type"], "test");
    assert!(got[1].is_signed_by(&secret));
    // One that never answers does not hold up the end.
    receiver.behaves(&[Behaves::Hangs]);
    announce(&site).await;
    receiver.comes(3).await;
    shutdown.cancel();
    running.await.unwrap();
}

#[tokio::test]
async fn a_team_has_so_many_webhooks_and_its_program_makes_none() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha, "Ada").await;
    let new = json!({ "name": "ours", "url": "https://example.org/faceoff" });
    let all = "/api/v1/webhooks";
    site.post(all, Some(&alpha.token), &new)
        .await
        .problem(403, "forbidden", &["member"]);
    for _ in 0..5 {
        hook(&site, &ada, "https://example.org/faceoff", &[]).await;
    }
    site.post(all, Some(&ada), &new)
        .await
        .problem(409, "conflict", &["5 webhooks"]);
    let listed = site.get(all, Some(&alpha.token)).await.json(200);
    let first = format!("{all}/{}", text(&listed[0]["id"]));
    let gone = site.request(Method::DELETE, &first, Some(&ada));
    assert_eq!(gone.send().await.unwrap().status(), 204);
    site.get(&first, Some(&ada))
        .await
        .problem(404, "not-found", &[]);
    hook(&site, &ada, "https://example.org/faceoff", &["board"]).await;
    for (about, words) in [
        (json!(["boards"]), "boards"),
        (json!(vec!["board"; 51]), "50"),
    ] {
        let wrong = json!({ "name": "ours", "url": "https://example.org/", "about": about });
        let answer = site.post(all, Some(ADMIN), &wrong).await;
        answer.problem(422, "invalid-content", &["about", words]);
    }
    // An organiser sees all, and does not lead what a team is told elsewhere.
    let path = format!("{all}/{}", text(&listed[1]["id"]));
    let elsewhere = json!({ "url": "https://example.com/" });
    patch(&site, &path, ADMIN, elsewhere)
        .await
        .problem(403, "forbidden", &["member of the team"]);
    let renamed = patch(&site, &path, ADMIN, json!({ "name": "theirs" })).await;
    assert_eq!(renamed.json(200)["name"], "theirs");
}
