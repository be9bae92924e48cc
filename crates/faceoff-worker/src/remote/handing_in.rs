//! What came of orders, on its way to the server.

use super::far_server::{FarServer, REST};
use anyhow::Context as _;
use async_nats::HeaderMap;
use faceoff_wire::{
    remote::{Outcome, RemoteOutcome},
    work::Lease,
};
use std::time::{Duration, Instant};

/// More than the headers of an outcome have; they count as part of the message.
const HEADERS_AT_MOST: usize = 256;
/// From handing an outcome to the client until NATS says that it has it.
const STORED_WITHIN: Duration = Duration::from_secs(10);

impl FarServer {
    /// Sends what came of an order, until NATS has stored it or, of what was played, until the order is no longer this slot's: where it is in the
    /// stream of outcomes, if it is there. What is too large stays so until somebody helps: after a lease, the server is to know.
    pub(super) async fn send(
        &self,
        lease: &Lease,
        grant: &str,
        outcome: Outcome,
    ) -> anyhow::Result<Option<u64>> {
        let was_played = matches!(outcome, Outcome::Done { .. });
        let outcome = RemoteOutcome {
            lease: lease.clone(),
            grant: grant.to_owned(),
            outcome,
        };
        let mut headers = HeaderMap::new();
        headers.insert("Nats-Msg-Id", outcome.id());
        let payload = serde_json::to_vec(&outcome)?;
        let began = Instant::now();
        let within = Duration::from_secs(lease.duration_s.into());
        let subject = self.link.names.outcomes(self.link.worker.as_str());
        // The log is told of a change, not of every try.
        let mut told = String::new();
        loop {
            let sent = async {
                // It may be another after NATS was started anew.
                let largest = self.link.client.max_payload();
                if payload.len() + HEADERS_AT_MOST > largest {
                    return Err(anyhow::Error::from(TooLarge {
                        bytes: payload.len(),
                        largest,
                    }));
                }
                let sent = self.jetstream.publish_with_headers(
                    subject.clone(),
                    headers.clone(),
                    payload.clone().into(),
                );
                let stored = async { anyhow::Ok(sent.await?.await?) };
                let stored = tokio::time::timeout(STORED_WITHIN, stored).await;
                stored.context("NATS has not answered in time")?
            };
            let error = match sent.await {
                Ok(stored) => return Ok(Some(stored.sequence)),
                Err(error) => error,
            };
            if was_played && self.has_ended() {
                return Ok(None);
            }
            if error.is::<TooLarge>() && began.elapsed() >= within {
                return Err(error).context("sending what came of the order");
            }
            let cause = format!("{error:#}");
            if cause != told {
                tracing::warn!(unit = %lease.unit, cause, "what came of the order is not stored by NATS yet; trying again");
                self.cannot_hand_in(&cause);
                told = cause;
            }
            if was_played {
                self.rest().await;
            } else {
                // At the shutdown, too, it is tried again.
                tokio::time::sleep(REST).await;
            }
        }
    }
}

/// NATS takes no message of this size.
#[derive(Debug, thiserror::Error)]
#[error(
    "what came of the order has {bytes} bytes, and NATS takes messages of {largest} at most: raise its max_payload"
)]
pub(crate) struct TooLarge {
    bytes: usize,
    largest: usize,
}
