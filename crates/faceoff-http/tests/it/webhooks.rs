//! Tests of webhooks (URLs to which the server delivers events), with a receiver on a real port that verifies the signatures.

use crate::{
    site::{ADMIN, Answer, Site, result, string},
    users::member,
    webhook_receiver::{Behaviour, Receiver},
};
use faceoff_notify::{Deliverer, WebhookRules};
use reqwest::Method;
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

/// Rules that allow deliveries to this host.
fn rules_for_loopback() -> WebhookRules {
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

/// Makes all deliveries that are due.
async fn deliver(site: &Site) {
    deliverer(site, rules_for_loopback())
        .deliver_due()
        .await
        .unwrap();
}

/// Creates a webhook for the events of these topics; of all topics if there are none. Returns its path and its secret.
async fn create_webhook(site: &Site, token: &str, url: &str, topics: &[&str]) -> (String, String) {
    let webhook = json!({ "name": "test hook", "url": url, "about": topics });
    let created = site.post("/api/v1/webhooks", Some(token), &webhook).await;
    let created = created.json(201);
    let secret = string(&created["secret"]);
    assert!(secret.starts_with("whsec_"));
    let path = format!("/api/v1/webhooks/{}", string(&created["id"]));
    (path, secret)
}

async fn patch(site: &Site, path: &str, token: &str, body: Value) -> Answer {
    site.patch(path, Some(token), &body).await
}

/// The deliveries of a webhook, newest first.
async fn deliveries(site: &Site, path: &str) -> Vec<Value> {
    let path = format!("{path}/deliveries");
    let deliveries = site.get(&path, Some(ADMIN)).await.json(200);
    deliveries.as_array().unwrap().clone()
}

#[tokio::test]
async fn webhook_gets_the_events_visible_to_its_owner() {
    let site = Site::start().await;
    let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
    let ada = member(&site, &alpha.id, "Ada").await.token;
    let (team_receiver, organiser_receiver) = (Receiver::start().await, Receiver::start().await);
    let (path, secret) = create_webhook(&site, &ada, &team_receiver.url, &[]).await;
    create_webhook(
        &site,
        ADMIN,
        &organiser_receiver.url,
        &["evaluations", "submissions"],
    )
    .await;
    let alpha_submission = site.valid_submission(&alpha, "a").await;
    site.valid_submission(&beta, "b").await;
    site.start_evaluation(&alpha, &alpha_submission).await;
    site.finish_evaluation(&result([0.511; 3], 777.5)).await;
    site.finish_evaluation(&result([0.7; 3], 20.0)).await;
    deliver(&site).await;

    let types = team_receiver.types();
    assert!(!types.contains(&"webhook_rotated".to_owned()));
    for kind in ["submission_valid", "day_started", "day_released"] {
        let count = types.iter().filter(|found| *found == kind).count();
        assert_eq!(count, 1, "{kind} in {types:?}");
    }
    let finished = types.iter().filter(|kind| *kind == "evaluation_finished");
    assert_eq!(finished.count(), 2, "results of both teams are public");
    let mut event_ids = Vec::new();
    for request in team_receiver.requests() {
        assert!(request.is_signed_by(&secret));
        assert!(!request.is_signed_by("whsec_AAAA"));
        assert_eq!(request.timestamp, site.now().as_second().to_string());
        assert!(!request.body.contains("51.1"), "no score: {}", request.body);
        let body = request.json();
        assert_eq!(body["type"], body["data"]["kind"]);
        assert_eq!(body["timestamp"], body["data"]["at"]);
        event_ids.push(body["data"]["id"].as_i64().unwrap());
    }
    let received = event_ids.len();
    event_ids.sort_unstable();
    event_ids.dedup();
    assert_eq!(event_ids.len(), received, "each event once");
    let organiser_types = organiser_receiver.types();
    for (kind, times) in [("submission_uploaded", 2), ("evaluation_queued", 2)] {
        let count = organiser_types
            .iter()
            .filter(|found| *found == kind)
            .count();
        assert_eq!(count, times, "{organiser_types:?}");
    }
    assert!(
        !organiser_types.contains(&"day_started".to_owned()),
        "the topic was not requested"
    );

    // Everything was delivered, so another run of the deliverer sends nothing.
    deliver(&site).await;
    assert_eq!(team_receiver.requests().len(), received);
    let listed = deliveries(&site, &path).await;
    assert_eq!(listed.len(), received);
    assert!(
        listed
            .iter()
            .all(|delivery| delivery["state"] == "delivered")
    );
    assert_eq!(listed[0]["last"]["status"], 204);
    // Deliveries are kept for two weeks.
    site.advance(15 * 24 * 3600);
    let removed = site.store.delete_old_deliveries(site.now()).await.unwrap();
    assert!(removed as usize >= received);
    assert_eq!(deliveries(&site, &path).await.len(), 0);
}

#[tokio::test]
async fn failed_delivery_is_retried_and_finally_given_up() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, _) = create_webhook(&site, ADMIN, &receiver.url, &["announced"]).await;
    receiver.add_behaviours(&[Behaviour::Respond(500)]);
    site.announce().await;
    deliver(&site).await;
    deliver(&site).await;
    assert_eq!(receiver.requests().len(), 1, "no retry before it is due");
    let view = site.get(&path, Some(ADMIN)).await.json(200);
    assert_eq!(view["state"], "failing");
    assert_eq!(view["since"], site.now().to_string());
    let delivery = &deliveries(&site, &path).await[0];
    assert_eq!(delivery["state"], "waiting");
    assert_eq!(delivery["last"]["status"], 500);
    assert_eq!(
        delivery["last"]["error"],
        "it answered 500, expected 200 to 299"
    );
    // The pause after the first failure has 5 seconds and a random part.
    let next_at: jiff::Timestamp = string(&delivery["next_at"]).parse().unwrap();
    assert!((5..=6).contains(&next_at.duration_since(site.now()).as_secs()));

    site.set_time(next_at);
    deliver(&site).await;
    let requests = receiver.requests();
    assert_eq!(requests.len(), 2);
    assert_eq!(
        (&requests[0].id, &requests[0].body),
        (&requests[1].id, &requests[1].body)
    );
    assert_ne!(requests[0].timestamp, requests[1].timestamp);
    let view = site.get(&path, Some(ADMIN)).await.json(200);
    assert_eq!(view["state"], "alive");

    // A delivery that always fails is attempted seven times. The longest pause between two attempts is shorter than 13 hours.
    const ATTEMPTS: usize = 7;
    receiver.add_behaviours(&[Behaviour::Respond(404); ATTEMPTS]);
    site.announce().await;
    for _ in 0..ATTEMPTS {
        deliver(&site).await;
        site.advance(13 * 3600);
    }
    deliver(&site).await;
    assert_eq!(receiver.requests().len(), 2 + ATTEMPTS);
    let given_up = &deliveries(&site, &path).await[0];
    assert_eq!(given_up["state"], "given_up");
    assert_eq!(given_up["attempts"], ATTEMPTS);
}

#[tokio::test]
async fn rotated_secret_signs_beside_the_old_one_for_a_day() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await.token;
    let receiver = Receiver::start().await;
    let (path, old_secret) = create_webhook(&site, &ada, &receiver.url, &["announced"]).await;
    let rotate = format!("{path}/rotate");
    site.post(&rotate, Some(ADMIN), &json!({}))
        .await
        .problem(403, "forbidden", &["only a member"]);
    let rotated = site.post(&rotate, Some(&ada), &json!({})).await.json(200);
    let new_secret = string(&rotated["secret"]);
    assert_ne!(old_secret, new_secret);
    site.announce().await;
    deliver(&site).await;
    let first = &receiver.requests()[0];
    assert!(first.is_signed_by(&old_secret) && first.is_signed_by(&new_secret));
    site.advance(24 * 3600);
    site.announce().await;
    deliver(&site).await;
    let second = &receiver.requests()[1];
    assert!(!second.is_signed_by(&old_secret) && second.is_signed_by(&new_secret));
    let view = site.get(&path, Some(&ada)).await;
    assert!(!view.body.contains("secret"), "{}", view.body);
}

#[tokio::test]
async fn webhook_that_answers_gone_is_dead_until_revived() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await.token;
    let receiver = Receiver::start().await;
    let (path, _) = create_webhook(&site, &ada, &receiver.url, &["announced"]).await;
    receiver.add_behaviours(&[Behaviour::Respond(410)]);
    site.announce().await;
    deliver(&site).await;
    let dead = site.get(&path, Some(&ada)).await.json(200);
    assert_eq!(dead["state"], "dead");
    assert!(string(&dead["reason"]).contains("410"));
    let log = "/api/v1/events?kind=webhook_died";
    let log = site.get(log, Some(ADMIN)).await.json(200);
    assert_eq!(log["events"][0]["subject"], format!("team:{}", alpha.id));
    site.announce().await;
    site.advance(3600);
    deliver(&site).await;
    assert_eq!(receiver.requests().len(), 1);
    let test = format!("{path}/test");
    site.post(&test, Some(&ada), &json!({}))
        .await
        .problem(409, "conflict", &["enable it first"]);

    let revived = patch(&site, &path, &ada, json!({ "state": "alive" })).await;
    assert_eq!(revived.json(200)["state"], "alive");
    site.announce().await;
    deliver(&site).await;
    assert_eq!(
        receiver.requests().len(),
        2,
        "only events after the revival are sent"
    );
}

#[tokio::test]
async fn webhook_that_fails_for_three_days_is_dead() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, _) = create_webhook(&site, ADMIN, &receiver.url, &["announced"]).await;
    // More failures than deliveries in an hour.
    let failures = [Behaviour::Respond(503); 40];
    receiver.add_behaviours(&failures);
    let id = path.strip_prefix("/api/v1/webhooks/").unwrap();
    // One failing delivery an hour, for three days.
    for _ in 0..72 {
        assert_eq!(site.get(&path, Some(ADMIN)).await.json(200)["id"], id);
        site.announce().await;
        deliver(&site).await;
        site.advance(3600);
        receiver.add_behaviours(&failures);
    }
    let mut view = site.get(&path, Some(ADMIN)).await.json(200);
    assert_eq!(view["state"], "failing");
    // The webhook is dead once the first delivery is given up. When that happens depends on random pauses.
    for _ in 0..48 {
        deliver(&site).await;
        view = site.get(&path, Some(ADMIN)).await.json(200);
        if view["state"] == "dead" {
            break;
        }
        site.advance(3600);
        receiver.add_behaviours(&failures);
    }
    assert_eq!(view["state"], "dead");
    assert!(string(&view["reason"]).contains("72 hours"), "{view}");
    assert!(string(&view["reason"]).contains("503"), "{view}");
}

#[tokio::test]
async fn redirects_are_not_followed_and_responses_not_shown() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, _) = create_webhook(&site, ADMIN, &receiver.url, &["announced"]).await;
    receiver.add_behaviours(&[Behaviour::Redirect, Behaviour::Respond(418)]);
    site.announce().await;
    deliver(&site).await;
    let redirected = &deliveries(&site, &path).await[0];
    assert_eq!(redirected["last"]["status"], 302);
    assert!(string(&redirected["last"]["error"]).contains("redirects are not followed"));
    site.advance(10);
    deliver(&site).await;
    assert_eq!(receiver.requests().len(), 2);
    let listed = site.get(&format!("{path}/deliveries"), Some(ADMIN)).await;
    assert!(listed.body.contains("418"));
    assert!(!listed.body.contains("secret response"), "{}", listed.body);
}

#[tokio::test]
async fn private_addresses_are_refused() {
    let site = Site::start().await;
    for (url, words) in [
        ("http://10.0.0.1/", "private network"),
        ("http://169.254.169.254/latest/meta-data", "link-local"),
        ("http://[::1]/", "loopback"),
        ("ftp://example.org/", "https://"),
        ("nowhere", "https://example.org"),
    ] {
        let webhook = json!({ "name": "test hook", "url": url });
        let answer = site.post("/api/v1/webhooks", Some(ADMIN), &webhook).await;
        answer.problem(422, "invalid-content", &["url", words]);
    }
    // A host name is resolved at delivery, so it is refused only then.
    let receiver = Receiver::start().await;
    let url_with_name = format!("http://localhost:{}/hook", receiver.port);
    let (with_name, _) = create_webhook(&site, ADMIN, &url_with_name, &["announced"]).await;
    let (with_address, _) = create_webhook(&site, ADMIN, &receiver.url, &["announced"]).await;
    site.announce().await;
    let strict_rules = WebhookRules {
        enabled: true,
        allow_private: Vec::new(),
        ..rules_for_loopback()
    };
    deliverer(&site, strict_rules).deliver_due().await.unwrap();
    assert_eq!(receiver.requests().len(), 0);
    // Whether a name exists in the operator's network is not said.
    for (path, words) in [
        (&with_name, "the host name has no address on the Internet"),
        (&with_address, "loopback"),
    ] {
        let refused = &deliveries(&site, path).await[0];
        assert_eq!(refused["last"]["status"], Value::Null);
        let error = string(&refused["last"]["error"]);
        assert!(error.contains(words), "{error}");
    }
}

#[tokio::test]
async fn interrupted_delivery_is_repeated_with_the_same_id() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, secret) = create_webhook(&site, ADMIN, &receiver.url, &["announced"]).await;
    receiver.add_behaviours(&[Behaviour::Hang]);
    site.announce().await;
    let interrupted = deliverer(&site, rules_for_loopback());
    let interrupted = tokio::spawn(async move { interrupted.deliver_due().await });
    receiver.wait_for(1).await;
    interrupted.abort();
    assert!(interrupted.await.unwrap_err().is_cancelled());
    assert_eq!(deliveries(&site, &path).await[0]["attempts"], 0);
    deliver(&site).await;
    let requests = receiver.requests();
    assert_eq!(requests.len(), 2);
    assert_eq!(
        (&requests[0].id, &requests[0].body),
        (&requests[1].id, &requests[1].body)
    );
    assert!(requests[1].is_signed_by(&secret));
    assert_eq!(deliveries(&site, &path).await.len(), 1);
}

#[tokio::test]
async fn running_deliverer_sends_at_once_and_shuts_down() {
    let site = Site::start().await;
    let receiver = Receiver::start().await;
    let (path, secret) = create_webhook(&site, ADMIN, &receiver.url, &["announced"]).await;
    let shutdown = CancellationToken::new();
    let deliverer = tokio::spawn(deliverer(&site, rules_for_loopback()).run(shutdown.clone()));
    site.announce().await;
    assert_eq!(receiver.wait_for(1).await[0].json()["type"], "announced");
    let test = format!("{path}/test");
    let queued = site.post(&test, Some(ADMIN), &json!({})).await.json(202);
    let requests = receiver.wait_for(2).await;
    assert_eq!(requests[1].id, string(&queued["id"]));
    assert_eq!(requests[1].json()["type"], "test");
    assert!(requests[1].is_signed_by(&secret));
    // A receiver that never answers does not delay the shutdown.
    receiver.add_behaviours(&[Behaviour::Hang]);
    site.announce().await;
    receiver.wait_for(3).await;
    shutdown.cancel();
    deliverer.await.unwrap();
}

#[tokio::test]
async fn webhooks_are_limited_and_created_by_members_only() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await.token;
    let new_webhook = json!({ "name": "test hook", "url": "https://example.org/faceoff" });
    let webhooks = "/api/v1/webhooks";
    site.post(webhooks, Some(&alpha.token), &new_webhook)
        .await
        .problem(403, "forbidden", &["member"]);
    for _ in 0..5 {
        create_webhook(&site, &ada, "https://example.org/faceoff", &[]).await;
    }
    site.post(webhooks, Some(&ada), &new_webhook)
        .await
        .problem(409, "conflict", &["5 webhooks"]);
    let listed = site.get(webhooks, Some(&alpha.token)).await.json(200);
    let webhook = format!("{webhooks}/{}", string(&listed[0]["id"]));
    let deleted = site.request(Method::DELETE, &webhook, Some(&ada));
    assert_eq!(deleted.send().await.unwrap().status(), 204);
    site.get(&webhook, Some(&ada))
        .await
        .problem(404, "not-found", &[]);
    create_webhook(&site, &ada, "https://example.org/faceoff", &["board"]).await;
    for (about, words) in [
        (json!(["boards"]), "boards"),
        (json!(vec!["board"; 51]), "50"),
    ] {
        let wrong = json!({ "name": "test hook", "url": "https://example.org/", "about": about });
        let answer = site.post(webhooks, Some(ADMIN), &wrong).await;
        answer.problem(422, "invalid-content", &["about", words]);
    }
    // An organiser sees and renames all webhooks, but cannot change the URL of a team's webhook.
    let path = format!("{webhooks}/{}", string(&listed[1]["id"]));
    let other_url = json!({ "url": "https://example.com/" });
    patch(&site, &path, ADMIN, other_url)
        .await
        .problem(403, "forbidden", &["member of the team"]);
    let renamed = patch(&site, &path, ADMIN, json!({ "name": "renamed" })).await;
    assert_eq!(renamed.json(200)["name"], "renamed");
}
