//! Tests of rate limits per address and per token. The limits refill so slowly that no result depends on the duration of the
//! test.

use crate::site::*;
use faceoff_http::{RateLimit, RateLimits};
use reqwest::Method;
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
        token: None,
    };
    let site = Site::start().await.with_rates(rates).await;
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
async fn rate_limit_applies_per_token() {
    let site = Site::start().await;
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let rates = RateLimits {
        address: None,
        token: limit_with_burst(5),
    };
    let site = site.with_rates(rates).await;
    let refused = request_until_refused(&site, Some(&alpha.token), None).await;
    refused.problem(429, "too-many-requests", &["a token", "5 at once"]);
    site.get("/api/v1/season", Some(&beta.token))
        .await
        .json(200);
    site.get("/api/v1/season", None).await.json(200);
}
