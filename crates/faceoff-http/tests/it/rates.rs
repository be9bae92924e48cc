//! How often somebody may ask. The bursts come back so slowly that no verdict depends on the time that a test takes.

use crate::site::*;
use faceoff_http::{Rate, RateLimits};
use reqwest::Method;
use std::num::NonZeroU32;

/// So many at once. A second more brings one more, and a request takes less than that.
fn at_once(burst: u32) -> Option<Rate> {
    Some(Rate {
        per_s: NonZeroU32::MIN,
        burst: NonZeroU32::new(burst).unwrap(),
    })
}

/// Asks until that is refused; the refusal.
async fn until_refused(site: &Site, token: Option<&str>, forwarded: Option<&str>) -> Answer {
    // As many as a machine may take a minute for.
    for _ in 0..100_000 {
        let mut request = site.request(Method::GET, "/api/v1/season", token);
        if let Some(address) = forwarded {
            request = request.header("x-forwarded-for", address);
        }
        let answer = Answer::of(request.send().await.unwrap()).await;
        if answer.status != 200 {
            return answer;
        }
    }
    panic!("nothing was refused");
}

async fn ask_for(site: &Site, address: &str) -> u16 {
    let request = site.request(Method::GET, "/api/v1/season", None);
    let request = request.header("x-forwarded-for", address);
    request.send().await.unwrap().status().as_u16()
}

#[tokio::test]
async fn an_address_that_asks_too_often_is_told_so_and_others_are_not() {
    let rates = RateLimits {
        address: at_once(5),
        token: None,
    };
    let site = Site::start().await.with_rates(rates).await;
    // The test's own address is a proxy's, which is believed.
    let refused = until_refused(&site, None, Some("192.0.2.1")).await;
    let problem = refused.problem(429, "too-many-requests", &["5 at once", "wait"]);
    assert_eq!(problem["limit_per_s"], 1);
    let wait: u64 = refused.header("retry-after").parse().unwrap();
    assert!((1..=2).contains(&wait), "{wait}");
    assert_eq!(ask_for(&site, "192.0.2.2").await, 200);
    // A proxy that says nothing asks for itself: what watches the server.
    for _ in 0..20 {
        site.get("/readyz", None).await.json(200);
    }
    let numbers = site.get("/metrics", Some(ADMIN)).await.body;
    assert!(
        numbers.contains("faceoff_http_refused_total{because=\"rate\"}"),
        "{numbers}"
    );
}

#[tokio::test]
async fn a_token_that_asks_too_often_is_told_so_from_wherever_it_does() {
    let site = Site::start().await;
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let rates = RateLimits {
        address: None,
        token: at_once(5),
    };
    let site = site.with_rates(rates).await;
    let refused = until_refused(&site, Some(&alpha.token), None).await;
    refused.problem(429, "too-many-requests", &["a token", "5 at once"]);
    site.get("/api/v1/season", Some(&beta.token))
        .await
        .json(200);
    site.get("/api/v1/season", None).await.json(200);
}
