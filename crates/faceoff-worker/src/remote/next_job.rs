//! Receiving jobs on a remote slot: the slot requests a job over NATS (a message broker), receives one, and asks the server
//! for the permission to start it.

use super::{
    connection::REQUEST_TIMEOUT, names::JOBS_CONSUMER, server_client::ServerClient,
    worker_link::with_timeout,
};
use anyhow::Context as _;
use async_nats::jetstream::{Message, consumer::PullConsumer};
use faceoff_wire::remote::{RemoteJob, RemoteJobEnd, WorkerRequest, WorkerResponse};
use futures::StreamExt as _;
use std::{
    sync::PoisonError,
    time::{Duration, Instant},
};

/// How long a request for a job stays open before it is repeated, since NATS may lose a request without an error. With this short time no
/// NATS heartbeats are needed: a `Batch` of async-nats (0.51) that has read a heartbeat is not woken by the next message,
/// so the job would be lost.
const REQUEST_OPEN_FOR: Duration = Duration::from_secs(5);
/// How long a registration lasts before it is repeated.
const REGISTRATION_VALIDITY: Duration = Duration::from_secs(5);
/// Number of attempts to start a job. A response may get lost; a repeated request of the same slot is accepted again.
const START_ATTEMPTS: u32 = 3;

impl ServerClient {
    /// Registers this worker and returns whether it gets jobs. Changes are logged. A recent registration need not be
    /// repeated: a job names its program version, and the server decides at its start whether the worker may run it.
    pub(super) async fn register(&self) -> anyhow::Result<bool> {
        let registered_at = || {
            let lock = self.link.registered_at.lock();
            lock.unwrap_or_else(PoisonError::into_inner)
        };
        if registered_at().is_some_and(|at| at.elapsed() < REGISTRATION_VALIDITY) {
            return Ok(true);
        }
        let response = self
            .link
            .request(&WorkerRequest::Register(self.link.capabilities.clone()))
            .await?;
        let reason = match response {
            WorkerResponse::Accepted => None,
            WorkerResponse::Refused { reason } => Some(reason),
            WorkerResponse::Unavailable => return Ok(false),
        };
        let mut logged_refusal = self
            .link
            .refusal
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if *logged_refusal != reason {
            match &reason {
                Some(reason) => tracing::error!(reason, "the server gives this worker no jobs"),
                None => tracing::info!("the server gives this worker jobs"),
            }
            logged_refusal.clone_from(&reason);
        }
        *registered_at() = reason.is_none().then(Instant::now);
        Ok(reason.is_none())
    }

    /// The consumer of jobs. It is looked up again after a failure, since the stream may have been recreated.
    async fn consumer(&self) -> anyhow::Result<PullConsumer> {
        let cached = || self.consumer.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(consumer) = cached().clone() {
            return Ok(consumer);
        }
        let stream = self.link.names.jobs_stream();
        let lookup = self
            .jetstream
            .get_consumer_from_stream(JOBS_CONSUMER, stream);
        let found: PullConsumer = with_timeout(lookup)
            .await
            .context("looking up the consumer of jobs")?;
        *cached() = Some(found.clone());
        Ok(found)
    }

    /// Waits for a job and starts it. Returns `None` if there is no job, or it cannot be started.
    pub(super) async fn next_job(&self, slot: &str) -> anyhow::Result<Option<RemoteJob>> {
        let link = &self.link;
        let consumer = self.consumer().await?;
        let request = consumer.batch().max_messages(1).expires(REQUEST_OPEN_FOR);
        let mut jobs = with_timeout(request.messages())
            .await
            .context("requesting a job")?;
        let subject = link.names.free_slots(link.worker.as_str());
        with_timeout(link.client.publish(subject, Default::default()))
            .await
            .context("requesting a job")?;
        let message = tokio::select! {
            // A job that arrives during the shutdown is not started, and the server puts it back into the queue.
            () = link.shutdown.cancelled() => return Ok(None),
            message = jobs.next() => message,
        };
        let Some(message) = message else {
            return Ok(None);
        };
        let message = message.map_err(|error| anyhow::anyhow!("waiting for a job: {error}"))?;
        // Each job is delivered once; the lease, not NATS, decides which slot runs it.
        let acknowledged = async { message.ack().await.map_err(|error| anyhow::anyhow!(error)) };
        with_timeout(acknowledged)
            .await
            .context("acknowledging a job")?;
        let Some(mut job) = self.read_job(&message) else {
            return Ok(None);
        };
        job.job.lease.holder = link.worker.slot_holder(slot);
        Ok(self.start_job(&job, slot).await.then_some(job))
    }

    /// Reads a job. If this worker cannot run it, the job is not started, so the server requeues it, and this worker
    /// registers again to learn the reason.
    fn read_job(&self, message: &Message) -> Option<RemoteJob> {
        let link = &self.link;
        let mut logged_cause = link
            .unreadable_cause
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        match serde_json::from_slice::<RemoteJob>(&message.payload) {
            Ok(job) => {
                logged_cause.clear();
                if job.program_blake3 == link.capabilities.program_blake3 {
                    return Some(job);
                }
            }
            Err(error) => {
                let cause = error.to_string();
                if *logged_cause != cause {
                    tracing::warn!(
                        cause,
                        "a job cannot be read and is not started; it may be from another version"
                    );
                    *logged_cause = cause;
                }
            }
        }
        link.invalidate_registration();
        None
    }

    /// Starts the job and returns whether this slot now has its lease. Without a response the slot may have it nevertheless;
    /// then the job is released, so that it need not wait for the expiry.
    async fn start_job(&self, job: &RemoteJob, slot: &str) -> bool {
        let link = &self.link;
        let (lease, id) = (&job.job.lease, job.job.lease.job_id);
        let request = WorkerRequest::StartJob {
            lease: lease.clone(),
            slot: slot.to_owned(),
        };
        let mut cause = String::new();
        for attempt in 0..START_ATTEMPTS {
            if attempt > 0 {
                self.pause().await;
                if link.shutdown.is_cancelled() {
                    break;
                }
            }
            cause = match link.request(&request).await {
                Ok(WorkerResponse::Accepted) => return true,
                Ok(WorkerResponse::Refused { .. }) => return false,
                Ok(WorkerResponse::Unavailable) => "the server cannot answer now".to_owned(),
                Err(error) => format!("{error:#}"),
            };
        }
        tracing::warn!(job = %id, cause, "no response to the start of a job: it is released");
        let sent = self.send_result(lease, &job.grant, RemoteJobEnd::Interrupted);
        let sent = tokio::time::timeout(REQUEST_TIMEOUT, sent).await;
        if let Err(error) = sent.map_err(anyhow::Error::from).flatten() {
            tracing::warn!(job = %id, cause = format!("{error:#}"), "the job could not be released; its lease will expire");
        }
        false
    }
}
