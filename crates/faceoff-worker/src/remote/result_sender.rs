//! Sending results of jobs to the server.

use super::server_client::{RETRY_INTERVAL, ServerClient};
use crate::server::TooLarge;
use anyhow::Context as _;
use async_nats::HeaderMap;
use faceoff_wire::{
    job::Lease,
    remote::{RemoteJobEnd, ResultMessage},
};
use std::time::{Duration, Instant};

/// Upper bound of the size of a result's headers, which count as part of the message.
const MAX_HEADER_BYTES: usize = 256;
/// Timeout for the acknowledgement of a message by NATS.
const PUBLISH_TIMEOUT: Duration = Duration::from_secs(10);

impl ServerClient {
    /// Sends the result of a job, with retries until NATS has stored it, and returns its sequence number in the stream of
    /// results. The result of a completed job is given up when the lease is lost; then `None` is returned. A message that is
    /// too large is given up after the duration of a lease, and the job ends with this error.
    pub(super) async fn send_result(
        &self,
        lease: &Lease,
        grant: &str,
        end: RemoteJobEnd,
    ) -> anyhow::Result<Option<u64>> {
        let is_done = matches!(end, RemoteJobEnd::Done { .. });
        let message = ResultMessage {
            lease: lease.clone(),
            grant: grant.to_owned(),
            end,
        };
        let mut headers = HeaderMap::new();
        headers.insert("Nats-Msg-Id", message.id());
        let payload = serde_json::to_vec(&message)?;
        let started_at = Instant::now();
        let give_up_after = Duration::from_secs(lease.duration_s.into());
        let subject = self.link.names.results(self.link.worker.as_str());
        // Only changes of the cause are logged.
        let mut logged_cause = String::new();
        loop {
            let sent = async {
                // The limit may change when NATS restarts.
                let max_payload = self.link.client.max_payload();
                if payload.len() + MAX_HEADER_BYTES > max_payload {
                    return Err(anyhow::Error::from(TooLarge {
                        bytes: payload.len(),
                        max_payload,
                    }));
                }
                let published = self.jetstream.publish_with_headers(
                    subject.clone(),
                    headers.clone(),
                    payload.clone().into(),
                );
                let stored = async { anyhow::Ok(published.await?.await?) };
                let stored = tokio::time::timeout(PUBLISH_TIMEOUT, stored).await;
                stored.context("NATS has not answered in time")?
            };
            let error = match sent.await {
                Ok(stored) => return Ok(Some(stored.sequence)),
                Err(error) => error,
            };
            if is_done && self.must_stop_job() {
                return Ok(None);
            }
            if error.is::<TooLarge>() && started_at.elapsed() >= give_up_after {
                return Err(error).context("sending the result");
            }
            let cause = format!("{error:#}");
            if cause != logged_cause {
                tracing::warn!(job = %lease.job_id, cause, "the result is not stored by NATS yet; trying again");
                self.set_send_problem(&cause);
                logged_cause = cause;
            }
            if is_done {
                self.pause().await;
            } else {
                // A release is also tried again during the shutdown.
                tokio::time::sleep(RETRY_INTERVAL).await;
            }
        }
    }
}
