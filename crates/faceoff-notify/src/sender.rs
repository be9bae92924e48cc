//! One message to one address.

use crate::{
    address::WebhookRules,
    resolver::{CheckedResolver, ResolveError},
    secret::signatures,
};
use faceoff_store::{AttemptMeans, Delivery, DeliveryAttempt, WebhookKeys};
use faceoff_types::DeliveryId;
use jiff::{SignedDuration, Timestamp};
use reqwest::{StatusCode, header, redirect};
use std::{error::Error, sync::Arc, time::Duration};

/// A receiver has so long to answer.
const PATIENCE: Duration = Duration::from_secs(15);
/// After an attempt that failed, the next one: the first after the first pause.
const PAUSES_S: [i64; 6] = [5, 5 * 60, 30 * 60, 2 * 3600, 5 * 3600, 10 * 3600];
/// Up to so much of a pause comes on top, so that not everything that failed at once comes again at once.
const JITTER: f64 = 0.2;

/// Sends, and follows nothing.
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
            .timeout(PATIENCE)
            // Nothing of a stranger's is held open.
            .pool_max_idle_per_host(0)
            .dns_resolver(CheckedResolver(Arc::clone(&rules)))
            .build()?;
        Ok(Self { rules, client })
    }

    /// Sends something, and says what came of it.
    pub(crate) async fn send(
        &self,
        url: &str,
        keys: &WebhookKeys,
        delivery: &Delivery,
        now: Timestamp,
    ) -> (DeliveryAttempt, AttemptMeans) {
        let answered = self.post(url, keys, delivery, now).await;
        let (status, error) = match answered {
            Ok(status) => (Some(status), refused(status)),
            Err(error) => (None, Some(error)),
        };
        let means = match (&error, status) {
            (None, _) => AttemptMeans::Taken,
            (Some(_), Some(StatusCode::GONE)) => AttemptMeans::Gone,
            (Some(_), _) => AttemptMeans::Failed {
                again_at: again_at(delivery.id, delivery.attempts, now),
            },
        };
        let attempt = DeliveryAttempt {
            at: now,
            status: status.map(|status| status.as_u16()),
            error,
        };
        (attempt, means)
    }

    /// What was answered. Of the body nothing is read: nobody is shown what an address says to us.
    async fn post(
        &self,
        url: &str,
        keys: &WebhookKeys,
        delivery: &Delivery,
        now: Timestamp,
    ) -> Result<StatusCode, String> {
        // Again: the rules may be others, and a literal address is looked up by nobody.
        let url = self.rules.check_url(url)?;
        let (id, timestamp) = (delivery.id.to_string(), now.as_second());
        let signature = signatures(keys, &id, timestamp, &delivery.body);
        let request = self
            .client
            .post(url)
            .header(header::CONTENT_TYPE, "application/json")
            .header("webhook-id", &id)
            .header("webhook-timestamp", timestamp)
            .header("webhook-signature", signature)
            .body(delivery.body.clone());
        let answer = request.send().await;
        answer
            .map(|answer| answer.status())
            .map_err(|error| words(&error))
    }
}

/// What is wrong with a status, if anything is.
fn refused(status: StatusCode) -> Option<String> {
    if status.is_success() {
        return None;
    }
    let code = status.as_u16();
    Some(if status.is_redirection() {
        format!("it answered {code}: redirects are not followed, name the address that it leads to")
    } else {
        format!("it answered {code}, expected 200 to 299")
    })
}

/// Why there was no answer, without what our network says of itself.
fn words(error: &reqwest::Error) -> String {
    let mut cause: Option<&(dyn Error + 'static)> = Some(error);
    while let Some(found) = cause {
        if let Some(resolving) = found.downcast_ref::<ResolveError>() {
            return resolving.to_string();
        }
        cause = found.source();
    }
    if error.is_timeout() {
        format!("it did not answer within {} s", PATIENCE.as_secs())
    } else if error.is_connect() {
        "no connection, or none with a certificate that is good".into()
    } else {
        "the connection broke off before there was an answer".into()
    }
}

/// When something is sent again that was sent so often before this time; `None`: never.
fn again_at(id: DeliveryId, attempts: u32, now: Timestamp) -> Option<Timestamp> {
    let pause = *PAUSES_S.get(usize::try_from(attempts).ok()?)?;
    // Derived, so that the same log is the same plan.
    let mut drawn = blake3::Hasher::new_derive_key("Faceoff: pauses between attempts of a webhook");
    drawn.update(id.as_uuid().as_bytes());
    drawn.update(&attempts.to_le_bytes());
    let [first, second, ..] = *drawn.finalize().as_bytes();
    let drawn = f64::from(u16::from_le_bytes([first, second])) / f64::from(u16::MAX);
    let pause = SignedDuration::from_secs(pause).mul_f64(1.0 + JITTER * drawn);
    now.checked_add(pause).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_are_no_two_alike_and_end() {
        let now: Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
        let ids = [DeliveryId::new(), DeliveryId::new()];
        for (attempts, pause) in (0..).zip(PAUSES_S) {
            for id in ids {
                let at = again_at(id, attempts, now).unwrap();
                let waits = at.duration_since(now).as_secs_f64();
                let pause = pause as f64;
                assert!((pause..=pause * (1.0 + JITTER)).contains(&waits));
                assert_eq!(Some(at), again_at(id, attempts, now), "derived");
            }
            assert_ne!(
                again_at(ids[0], attempts, now),
                again_at(ids[1], attempts, now)
            );
        }
        assert_eq!(again_at(ids[0], 6, now), None);
    }
}
