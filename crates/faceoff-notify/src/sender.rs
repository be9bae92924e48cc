//! Sends one message to one webhook, and decides when to try again after a failure.

use crate::{
    address::WebhookRules,
    resolver::{CheckedResolver, ResolveError},
    secret::signatures,
};
use faceoff_store::{Delivery, DeliveryAttempt, DeliveryOutcome, WebhookSecrets};
use faceoff_types::DeliveryId;
use jiff::{SignedDuration, Timestamp};
use reqwest::{StatusCode, header, redirect};
use std::{error::Error, sync::Arc, time::Duration};

/// Time that a receiver has to respond.
const RESPONSE_TIMEOUT: Duration = Duration::from_secs(15);
/// Pauses after the first, second … failed attempt, seconds. After one more failure the message is not sent again.
const RETRY_PAUSES_S: [i64; 6] = [5, 5 * 60, 30 * 60, 2 * 3600, 5 * 3600, 10 * 3600];
/// Maximum random extension, as a fraction of the pause: simultaneous failures must not be retried simultaneously.
const MAX_JITTER: f64 = 0.2;

/// Sends messages; redirects are not followed.
#[derive(Debug, Clone)]
pub(crate) struct Sender {
    rules: Arc<WebhookRules>,
    client: reqwest::Client,
}

impl Sender {
    pub(crate) fn new(
        rules: WebhookRules,
        tls: rustls::ClientConfig,
    ) -> Result<Self, reqwest::Error> {
        let rules = Arc::new(rules);
        let client = reqwest::Client::builder()
            .user_agent(concat!("Faceoff/", env!("CARGO_PKG_VERSION")))
            .tls_backend_preconfigured(tls)
            .redirect(redirect::Policy::none())
            .no_proxy()
            .timeout(RESPONSE_TIMEOUT)
            // No connections to untrusted receivers are kept open.
            .pool_max_idle_per_host(0)
            .dns_resolver(CheckedResolver(Arc::clone(&rules)))
            .build()?;
        Ok(Self { rules, client })
    }

    /// Sends a delivery. Returns the attempt and its outcome.
    pub(crate) async fn send(
        &self,
        url: &str,
        secrets: &WebhookSecrets,
        delivery: &Delivery,
        now: Timestamp,
    ) -> (DeliveryAttempt, DeliveryOutcome) {
        let response = self.post(url, secrets, delivery, now).await;
        let (status, error) = match response {
            Ok(status) => (Some(status), status_error(status)),
            Err(error) => (None, Some(error)),
        };
        let outcome = match (&error, status) {
            (None, _) => DeliveryOutcome::Accepted,
            (Some(_), Some(StatusCode::GONE)) => DeliveryOutcome::Gone,
            (Some(_), _) => DeliveryOutcome::Failed {
                retry_at: retry_at(delivery.id, delivery.attempts, now),
            },
        };
        let attempt = DeliveryAttempt {
            at: now,
            status: status.map(|status| status.as_u16()),
            error,
        };
        (attempt, outcome)
    }

    /// Posts a delivery. Returns the status of the response; its body is never read or shown.
    async fn post(
        &self,
        url: &str,
        secrets: &WebhookSecrets,
        delivery: &Delivery,
        now: Timestamp,
    ) -> Result<StatusCode, String> {
        // The URL was checked when it was registered, but the rules may have changed. The resolver checks host names
        // only, not IP addresses in URLs.
        let url = self.rules.check_url(url)?;
        let (id, timestamp) = (delivery.id.to_string(), now.as_second());
        let signature = signatures(secrets, &id, timestamp, &delivery.body);
        let request = self
            .client
            .post(url)
            .header(header::CONTENT_TYPE, "application/json")
            .header("webhook-id", &id)
            .header("webhook-timestamp", timestamp)
            .header("webhook-signature", signature)
            .body(delivery.body.clone());
        let response = request.send().await;
        response
            .map(|response| response.status())
            .map_err(|error| describe_error(&error))
    }
}

/// Error text for a status other than 2xx.
fn status_error(status: StatusCode) -> Option<String> {
    if status.is_success() {
        return None;
    }
    let code = status.as_u16();
    Some(if status.is_redirection() {
        format!(
            "it answered {code}: redirects are not followed, use the address that it redirects to"
        )
    } else {
        format!("it answered {code}, expected 200 to 299")
    })
}

/// Why there was no response, without details of the server's network.
fn describe_error(error: &reqwest::Error) -> String {
    let mut cause: Option<&(dyn Error + 'static)> = Some(error);
    while let Some(found) = cause {
        if let Some(resolve_error) = found.downcast_ref::<ResolveError>() {
            return resolve_error.to_string();
        }
        cause = found.source();
    }
    if error.is_timeout() {
        format!("it did not answer within {} s", RESPONSE_TIMEOUT.as_secs())
    } else if error.is_connect() {
        "no connection, or the certificate is not valid".into()
    } else {
        "the connection was closed before there was a response".into()
    }
}

/// Time of the next attempt after one that failed now; `None` after the last attempt. `earlier_attempts` does not count
/// the one that failed now.
fn retry_at(id: DeliveryId, earlier_attempts: u32, now: Timestamp) -> Option<Timestamp> {
    let pause_s = *RETRY_PAUSES_S.get(usize::try_from(earlier_attempts).ok()?)?;
    // The jitter derives from the delivery's id, so that it is reproducible.
    let mut hasher =
        blake3::Hasher::new_derive_key("Faceoff: pauses between attempts of a webhook");
    hasher.update(id.as_uuid().as_bytes());
    hasher.update(&earlier_attempts.to_le_bytes());
    let [first, second, ..] = *hasher.finalize().as_bytes();
    // From 0 to 1.
    let random = f64::from(u16::from_le_bytes([first, second])) / f64::from(u16::MAX);
    let pause = SignedDuration::from_secs(pause_s).mul_f64(1.0 + MAX_JITTER * random);
    now.checked_add(pause).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn retry_pauses_grow_vary_and_end() {
        let now: Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
        let ids = [DeliveryId::new(), DeliveryId::new()];
        for (earlier_attempts, min_pause_s) in (0..).zip(RETRY_PAUSES_S) {
            for id in ids {
                let at = retry_at(id, earlier_attempts, now).unwrap();
                let pause_s = at.duration_since(now).as_secs_f64();
                let min_pause_s = min_pause_s as f64;
                assert!((min_pause_s..=min_pause_s * (1.0 + MAX_JITTER)).contains(&pause_s));
                assert_eq!(
                    Some(at),
                    retry_at(id, earlier_attempts, now),
                    "the time is deterministic"
                );
            }
            assert_ne!(
                retry_at(ids[0], earlier_attempts, now),
                retry_at(ids[1], earlier_attempts, now)
            );
        }
        let earlier_attempts = u32::try_from(RETRY_PAUSES_S.len()).unwrap();
        assert_eq!(retry_at(ids[0], earlier_attempts, now), None);
    }
}
