//! Tests of rate limits per address and per token. The limits refill so slowly that no result depends on the duration of the
//! test.

use crate::site::*;
use faceoff_http::{RateLimit, RateLimits};
use reqwest::Method;
use serde_json::json;
use std::num::NonZeroU32;

/// A limit of `burst` requests at once and one per second. A request takes less than a second.
fn limit_with_burst(burst: u32) -> Option<RateLimit> {
    Some(RateLimit {
        per_s: NonZeroU32::MIN,
        burst: NonZeroU32::new(burst).unwrap(),
    })
}

/// Sends requests until one is refused. Returns that response. `forwarded` is the client address that a proxy names.
async fn request_until_refused(
    site: &Site,
    token: Option<&str>,
    forwarded: Option<&str>,
) -> Answer {
    // On a slow machine this takes a minute.
    const MAX_REQUESTS: u32 = 100_000;
    for _ in 0..MAX_REQUESTS {
        let mut request = site.request(Method::GET, "/api/v1/season", token);
        if let Some(address) = forwarded {
            request = request.header("x-forwarded-for", address);
        }
        let answer = Answer::read(request.send().await.unwrap()).await;
        if answer.status != 200 {
            return answer;
        }
    }
    panic!("nothing was refused");
}

/// The status of a response to a client with this address.
async fn request_from(site: &Site, address: &str) -> u16 {
    let request = site.request(Method::GET, "/api/v1/season", None);
    let request = request.header("x-forwarded-for", address);
    request.send().await.unwrap().status().as_u16()
}

#[tokio::test]
async fn rate_limit_applies_per_address() {
    let rates = RateLimits {
        address: limit_with_burst(5),
        ..RateLimits::default()
    };
    let site = Site::start().await.with_rate_limits(rates).await;
    // The server trusts the test's loopback address as a proxy.
    let refused = request_until_refused(&site, None, Some("192.0.2.1")).await;
    let problem = refused.problem(429, "too-many-requests", &["5 at once", "wait"]);
    assert_eq!(problem["limit_per_s"], 1);
    let wait: u64 = refused.header("retry-after").parse().unwrap();
    assert!((1..=2).contains(&wait), "{wait}");
    assert_eq!(request_from(&site, "192.0.2.2").await, 200);
    // Requests of the proxy itself, such as monitoring, are not limited.
    for _ in 0..20 {
        site.get("/readyz", None).await.json(200);
    }
    let metrics = site.get("/metrics", Some(ADMIN)).await.body;
    assert!(
        metrics.contains("faceoff_http_refused_total{because=\"rate\"}"),
        "{metrics}"
    );
}

#[tokio::test]
async fn signed_in_callers_share_no_rate_limit_of_an_address() {
    let site = Site::start().await;
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let rates = RateLimits {
        address: limit_with_burst(5),
        ..RateLimits::default()
    };
    let site = site.with_rate_limits(rates).await;
    let status = async |token: Option<&str>| {
        let request = site.request(Method::GET, "/api/v1/me", token);
        let request = request.header("x-forwarded-for", "192.0.2.1");
        request.send().await.unwrap().status().as_u16()
    };
    for team in [&alpha, &beta] {
        assert_eq!(status(Some(&team.token)).await, 200);
    }
    let refused = request_until_refused(&site, None, Some("192.0.2.1")).await;
    refused.problem(429, "too-many-requests", &["an address"]);
    // An unknown token counts as a visitor's.
    assert_eq!(status(Some("fo_unknown")).await, 429);
    assert_eq!(status(Some(&beta.token)).await, 200);
    let refused = request_until_refused(&site, Some(&alpha.token), Some("192.0.2.1")).await;
    refused.problem(429, "too-many-requests", &["a signed-in caller"]);
    assert_eq!(status(Some(&beta.token)).await, 200);
}

#[tokio::test]
async fn rate_limit_applies_per_token() {
    let site = Site::start().await;
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let rates = RateLimits {
        token: limit_with_burst(5),
        ..RateLimits::default()
    };
    let site = site.with_rate_limits(rates).await;
    let refused = request_until_refused(&site, Some(&alpha.token), None).await;
    refused.problem(429, "too-many-requests", &["a token", "5 at once"]);
    site.get("/api/v1/season", Some(&beta.token))
        .await
        .json(200);
    site.get("/api/v1/season", None).await.json(200);
}

#[tokio::test]
async fn search_and_card_count_as_several_requests() {
    let rates = RateLimits {
        address: limit_with_burst(1000),
        ..RateLimits::default()
    };
    let site = Site::start().await.with_rate_limits(rates).await;
    // A search counts as 10 requests, a picture as 5. So of 1000 requests at once, at least this many are answered.
    for (path, address, least) in [
        ("/docs/search?q=puck", "192.0.2.1", 100),
        ("/card.png", "192.0.2.2", 200),
    ] {
        let mut answered = 0;
        loop {
            let request = site.request(Method::GET, path, None);
            let request = request.header("x-forwarded-for", address);
            match request.send().await.unwrap().status().as_u16() {
                200 => answered += 1,
                status => {
                    assert_eq!(status, 429);
                    break;
                }
            }
            assert!(
                answered < 500,
                "as requests that count once, 1000 are answered"
            );
        }
        assert!(answered >= least, "{path}: {answered}");
    }
}

#[tokio::test]
async fn token_may_use_half_of_the_daily_change_quota() {
    let site = Site::start().await;
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let rates = RateLimits {
        team_changes_per_day: NonZeroU32::new(6),
        ..RateLimits::default()
    };
    let site = site.with_rate_limits(rates).await;
    let ask = async |token: &str| {
        let question = json!({ "text": "When does the stage end?" });
        site.post("/api/v1/questions", Some(token), &question).await
    };
    let first = ask(&alpha.token).await;
    assert_eq!(first.status, 201, "{}", first.body);
    assert_eq!(first.header("ratelimit-policy"), "\"changes\";q=6;w=86400");
    let remaining = first.header("ratelimit");
    assert!(remaining.starts_with("\"changes\";r=5;t="), "{remaining}");
    // A refused change counts, too.
    let invalid = site
        .post("/api/v1/questions", Some(&alpha.token), &json!({}))
        .await;
    assert_eq!(invalid.status, 422);
    assert_eq!(ask(&alpha.token).await.status, 201);
    // One token may use half of its team's quota: 3 of 6 changes.
    let refused = ask(&alpha.token).await;
    let problem = refused.problem(
        429,
        "daily-change-quota-exceeded",
        &["this token has made 3 changes today"],
    );
    assert_eq!(problem["limit"], 6);
    let wait: u32 = refused.header("retry-after").parse().unwrap();
    assert!((1..=24 * 3600).contains(&wait), "{wait}");
    // Reads are not limited, and neither are other teams and organisers.
    let me = site.get("/api/v1/me", Some(&alpha.token)).await;
    me.json(200);
    assert_eq!(ask(&beta.token).await.status, 201);
    for _ in 0..5 {
        let announcement = json!({ "title": "News", "text": "Nothing new" });
        let answer = site
            .post("/api/v1/announcements", Some(ADMIN), &announcement)
            .await;
        assert_eq!(answer.status, 201, "{}", answer.body);
        assert!(answer.headers.get("ratelimit").is_none());
    }
}
