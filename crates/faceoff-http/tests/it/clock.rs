//! Steps of the system clock: the server continues its own time, tells the organisers, and one of them can accept the step.

use crate::{
    browser::Browser,
    html::{links, texts},
    site::{ADMIN, LEASE_S, Site, result},
    team_dashboard::{dashboard_page, redirect_target},
};
use faceoff_store::{Actor, JobClaim};
use faceoff_testkit::assert_contains;
use faceoff_types::ClockStart;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};

const ACCEPT: &str = "/api/v1/clock/accept";

/// The browser of Grace, an organiser.
async fn grace(site: &Site) -> Browser<'_> {
    let role = json!({ "role": "organiser", "note": "Grace" });
    Browser::join(site, "Grace", role).await
}

fn days(days: i64) -> SignedDuration {
    SignedDuration::from_hours(24 * days)
}

fn time(text: &str) -> Timestamp {
    text.parse().unwrap()
}

/// A site with daily cutoffs at 06:00. It is ten o'clock, and one shard of today's evaluation runs.
async fn running_site() -> (Site, JobClaim) {
    let site = Site::start_with_schedule("06:00").await;
    let site = site.with_steady_clock(ClockStart::default()).await;
    site.team_with_evaluation("Alpha", "a").await;
    let (claim, ..) = site.claim_shard().await;
    (site, claim)
}

/// Starts the days that are due by the server's clock. Returns the number of all days.
async fn update_due_days(site: &Site) -> usize {
    let competition = faceoff_airhockey::competition();
    let now = site.clock().now();
    let started = faceoff_worker::update_due_days(&site.store, &competition, now).await;
    started.unwrap();
    site.store.days().await.unwrap().len()
}

async fn main_text(grace: &mut Browser<'_>) -> String {
    let page = dashboard_page(&grace.open("/organiser").await, 200);
    texts(&page, "main").concat()
}

/// Asserts that the server reports no step of the system clock, and that there is none to accept.
async fn assert_no_clock_step(site: &Site, grace: &mut Browser<'_>) {
    site.get("/api/v1/health", None).await.json(200);
    assert!(!main_text(grace).await.contains("system clock"));
    let refused = site.post(ACCEPT, Some(ADMIN), &json!({})).await;
    refused.problem(409, "conflict", &["no step"]);
}

#[tokio::test]
async fn clock_step_is_reported_and_changes_nothing() {
    let (site, mut claim) = running_site().await;
    let mut grace = grace(&site).await;
    assert_no_clock_step(&site, &mut grace).await;
    for (ahead, size) in [(days(5), "432000 s ahead"), (days(-1), "86400 s behind")] {
        site.set_system_clock(ahead);
        for path in ["/api/v1/health", "/readyz"] {
            let answer = site.get(path, None).await;
            answer.problem(503, "not-ready", &[size, "2026-03-01T10:00"]);
            assert_contains(&answer.body, &["\"clock\":\"set\""]);
        }
        let text = main_text(&mut grace).await;
        assert_contains(&text, &["The system clock is", size]);
        let metrics = site.get("/metrics", Some(ADMIN)).await.body;
        let gauge = format!("faceoff_clock_step_seconds {:?}", ahead.as_secs_f64());
        assert_contains(&metrics, &[gauge.as_str()]);
        // The running job keeps its lease, and no other worker gets it. Other jobs run, at once or again.
        let now = site.clock().now();
        let renewed = site.store.heartbeat(&claim, 0, LEASE_S, now).await;
        assert!(renewed.unwrap());
        let other = site.store.claim("other", LEASE_S, now).await.unwrap();
        let other = other.expect("another shard is pending").claim;
        assert_ne!(other.job, claim.job);
        site.store.release(&claim, now).await.unwrap();
        let again = site.store.claim("again", LEASE_S, now).await.unwrap();
        assert_eq!(again.expect("it was released").claim.job, claim.job);
        claim = other;
        // No day starts.
        assert_eq!(update_due_days(&site).await, 1);
        let season = site.get("/api/v1/season", None).await.json(200);
        assert_eq!(season["today"], "2026-03-01");
        site.set_system_clock(SignedDuration::ZERO);
        assert_no_clock_step(&site, &mut grace).await;
    }
    // A cutoff that the monotonic clock explains comes in time, although the system clock is wrong.
    site.set_system_clock(days(-1));
    site.next_day();
    assert_eq!(update_due_days(&site).await, 2);
}

#[tokio::test]
async fn organiser_accepts_a_clock_step() {
    let (site, claim) = running_site().await;
    let post = async |body: Value| site.post(ACCEPT, Some(ADMIN), &body).await;
    site.set_system_clock(days(1));
    let effect = [
        "nothing is done yet",
        "86400 s ahead",
        "2026-03-02T10:00:00Z",
        "Cutoffs",
    ];
    post(json!({})).await.problem(409, "not-confirmed", &effect);
    // A step that came after the organiser had looked is not accepted.
    site.set_system_clock(days(5));
    let one_day = json!({ "confirm": "86400 s ahead" });
    let refused = post(one_day.clone()).await;
    refused.problem(409, "not-confirmed", &["432000 s ahead"]);
    assert_eq!(update_due_days(&site).await, 1);
    site.set_system_clock(days(1));
    assert_eq!(post(one_day.clone()).await.status, 204);
    site.get("/api/v1/health", None).await.json(200);
    post(one_day).await.problem(409, "conflict", &["no step"]);
    // The running job keeps its lease, and no other worker gets it.
    let now = site.clock().now();
    assert_eq!(now, time("2026-03-02T10:00:00Z"));
    let other = site.store.claim("other", LEASE_S, now).await.unwrap();
    assert_ne!(other.unwrap().claim.job, claim.job);
    let renewed = site.store.heartbeat(&claim, 0, LEASE_S, now).await;
    assert!(renewed.unwrap());
    // The cutoff of the second day is due, which is also the deadline of the first.
    assert_eq!(update_due_days(&site).await, 2);
    let path = "/api/v1/events?limit=1&kind=clock_step_accepted";
    let log = site.get(path, Some(ADMIN)).await;
    assert_contains(&log.body, &["86400 s ahead"]);
}

#[tokio::test]
async fn clock_step_is_accepted_on_the_dashboard() {
    let (site, _) = running_site().await;
    let mut grace = grace(&site).await;
    site.set_system_clock(days(-1));
    let page = dashboard_page(&grace.open("/organiser").await, 200);
    let link = links(&page, "a[href='/organiser/decide/accept-clock']").remove(0);
    let page = grace.open(&link).await;
    assert_contains(&page.body, &["86400 s behind", "2026-02-28"]);
    let confirmed = [("confirm", "86400 s behind")];
    let done = grace.submit(&link, &confirmed).await;
    assert!(redirect_target(&done).contains("done=clock-accepted"));
    assert_no_clock_step(&site, &mut grace).await;
    assert_eq!(site.clock().now(), time("2026-02-28T10:00:00Z"));
}

#[tokio::test]
async fn only_organisers_accept_a_clock_step() {
    let (site, _) = running_site().await;
    let team = site.team("Beta").await;
    site.set_system_clock(days(5));
    let body = json!({ "confirm": "432000 s ahead" });
    let refused = site.post(ACCEPT, None, &body).await;
    refused.problem(401, "unauthenticated", &[]);
    let refused = site.post(ACCEPT, Some(&team.token), &body).await;
    refused.problem(403, "forbidden", &[]);
    assert!(site.clock().step().is_some());
}

#[tokio::test]
async fn server_start_before_newest_change_is_reported() {
    let site = Site::start_with_schedule("06:00").await;
    let start = ClockStart {
        // No earlier process of this boot has recorded when its monotonic clock was zero.
        zero_at: None,
        newest_change_at: Some(site.now() + SignedDuration::from_hours(1)),
    };
    let site = site.with_steady_clock(start).await;
    let health = site.get("/api/v1/health", None).await;
    health.problem(503, "not-ready", &["3600 s behind", "newest change"]);
    let team = site.team("Alpha").await;
    site.valid_submission(&team, "jobs-run").await;
    let confirm = json!({ "confirm": "3600 s behind" });
    assert_eq!(site.post(ACCEPT, Some(ADMIN), &confirm).await.status, 204);
    let mut grace = grace(&site).await;
    assert_no_clock_step(&site, &mut grace).await;
    assert_eq!(site.clock().now(), site.now());
}

#[tokio::test]
async fn future_day_is_reported_and_can_be_voided() {
    let site = Site::start_with_schedule("06:00").await;
    // The clock was five days ahead for a minute, with an earlier version or because an organiser accepted it.
    site.advance(5 * 86_400);
    site.add_ranked_teams(&[("Alpha", result([0.9; 3], 10.0))])
        .await;
    site.advance(-5 * 86_400);
    let mut grace = grace(&site).await;
    let stage = site.stage().await;
    let next_day = async || {
        let stages = site.get("/api/v1/stages", None).await.json(200);
        stages[0]["next_cutoff"]["day"].clone()
    };
    assert_eq!(next_day().await, "2026-03-07");
    let text = main_text(&mut grace).await;
    assert_contains(&text, &["Evaluation day 2026-03-06", "is in the future"]);
    let page = dashboard_page(&grace.open("/organiser").await, 200);
    let link = format!("/organiser/decide/void-day/{stage}/2026-03-06");
    assert_eq!(links(&page, &format!("a[href='{link}']")).len(), 1);
    grace.open(&link).await;
    let voided = [("reason", "wrong clock"), ("confirm", "2026-03-06")];
    let done = grace.submit(&link, &voided).await;
    assert!(redirect_target(&done).contains("done=day-voided"));
    assert_eq!(next_day().await, "2026-03-02");
    assert!(!main_text(&mut grace).await.contains("is in the future"));
    site.next_day();
    assert_eq!(update_due_days(&site).await, 2);
    assert_eq!(next_day().await, "2026-03-03");
    let again = site.store.start_day(Actor::Operator, stage, site.now());
    assert!(again.await.is_err(), "a day has one cutoff");
}
