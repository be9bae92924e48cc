//! A client of the workers' protocol that runs no jobs. It takes jobs like any other worker, and reports results that it never
//! computed. In the protocol, `order` is a job, `outcomes` are results, and `asks` are requests of workers.

use async_nats::{
    Client, HeaderMap,
    jetstream::{self, consumer::PullConsumer},
};
use faceoff_tests::nats::Nats;
use futures::StreamExt as _;
use serde_json::{Value, json};
use std::time::Duration;

/// A client that uses the workers' protocol and runs no jobs.
pub(crate) struct FakeWorker {
    pub(crate) client: Client,
}

impl FakeWorker {
    /// Connects with the inbox prefix of a worker named `liar`, to which the server answers.
    pub(crate) async fn connect(nats: &Nats) -> Self {
        let options = async_nats::ConnectOptions::new().custom_inbox_prefix("_INBOX.faceoff.liar");
        let client = options.connect(nats.url()).await;
        Self {
            client: client.expect("NATS is there"),
        }
    }

    pub(crate) async fn request(&self, request: &Value) -> Value {
        let answer = self.try_request(request).await;
        answer.expect("the server answers")
    }

    /// The answer to a request; `None` if no server answers.
    async fn try_request(&self, request: &Value) -> Option<Value> {
        let payload = serde_json::to_vec(request).expect("it is JSON");
        let answer = self.client.request("faceoff.asks.liar", payload.into());
        let answer = answer.await.ok()?;
        Some(serde_json::from_slice(&answer.payload).expect("an answer is JSON"))
    }

    /// Takes a job and its lease.
    pub(crate) async fn take_job(&self) -> Value {
        let jetstream = jetstream::new(self.client.clone());
        loop {
            let consumer: Result<PullConsumer, _> = jetstream
                .get_consumer_from_stream("workers", "faceoff-orders")
                .await;
            let Ok(consumer) = consumer else {
                // The server has not created it yet.
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            };
            let jobs = consumer.batch().max_messages(1).messages().await;
            let Some(Ok(job)) = jobs.expect("NATS is there").next().await else {
                continue;
            };
            job.ack().await.expect("NATS is there");
            let job: Value = serde_json::from_slice(&job.payload).expect("a job is JSON");
            let start_request =
                json!({ "kind": "begin", "lease": job["order"]["lease"], "slot": "slot-0" });
            let answer = self.try_request(&start_request).await;
            if answer.is_some_and(|answer| answer["kind"] == "yes") {
                return job;
            }
        }
    }

    /// Reports a job's first episode as successful, although it was never run.
    pub(crate) async fn report_shard(&self, job: &Value) {
        let assignment = &job["order"]["assignment"];
        let spec = &assignment["spec"];
        let outcome = json!({
            "task": spec["task"], "episode": spec["episodes"]["start"], "steps": 20, "end": "horizon", "success": true,
            "violations": { "ee": false, "link": false, "joint_pos": false, "joint_vel": false },
            "computation_time": { "mean_s": 0.001, "max_s": 0.002 }, "fault": null
        });
        let report = json!({
            "kind": "play", "outcomes": [outcome], "log": "", "stopped_by_faults": false,
            "recording": assignment["keeps"]["recording"],
        });
        self.send_report(job, report).await;
    }

    /// Reports the result of a game that was never run.
    pub(crate) async fn report_game(&self, job: &Value) {
        let hash = "0".repeat(64);
        let report = json!({
            "kind": "game", "score": { "winner": "first" }, "logs": ["", ""],
            "recording": {
                "key": job["order"]["assignment"]["recording"], "game_blake3": hash, "side_blake3": [hash, hash],
            },
        });
        self.send_report(job, report).await;
    }

    /// Sends a worker's result message again: as that worker, as another worker, with a changed result, and with a forged lease.
    /// Calls with different labels send different message ids, since NATS stores only one message of each id.
    pub(crate) async fn repeat_result(&self, result: &Value, label: &str) {
        let mut changed = result.clone();
        let success = &mut changed["outcome"]["report"]["outcomes"][0]["success"];
        *success = json!(!success.as_bool().unwrap_or_default());
        let mut forged = result.clone();
        forged["lease"]["nonce"] = json!("00000000-0000-4000-8000-000000000000");
        let nonce = result["lease"]["nonce"]
            .as_str()
            .expect("a lease has a nonce");
        for (subject, message, variant) in [
            ("faceoff.outcomes.honest", result, "repeated"),
            ("faceoff.outcomes.thief", result, "stolen"),
            ("faceoff.outcomes.thief", &changed, "stolen-and-changed"),
            ("faceoff.outcomes.honest", &forged, "forged"),
        ] {
            self.publish(subject, &format!("{nonce} {variant} {label}"), message)
                .await;
        }
    }

    pub(crate) async fn send_report(&self, job: &Value, report: Value) {
        let lease = &job["order"]["lease"];
        let message = json!({
            "lease": lease, "grant": job["grant"], "outcome": { "kind": "done", "report": report },
        });
        let ids = [&lease["unit"], &lease["nonce"]].map(|id| id.as_str().expect("an id is a text"));
        self.publish("faceoff.outcomes.liar", &ids.join("/"), &message)
            .await;
    }

    /// Reports that the job failed. Each label makes another message.
    pub(crate) async fn report_failure(&self, job: &Value, label: &str) {
        let message = json!({
            "lease": job["order"]["lease"], "grant": job["grant"],
            "outcome": { "kind": "platform_fault", "reason": "nothing works" },
        });
        self.publish("faceoff.outcomes.liar", label, &message).await;
    }

    pub(crate) async fn publish(&self, subject: &'static str, message_id: &str, message: &Value) {
        let payload = serde_json::to_vec(message).expect("it is JSON");
        self.publish_bytes(subject, message_id, payload).await;
    }

    /// Sends bytes in place of a result message.
    pub(crate) async fn publish_bytes(
        &self,
        subject: &'static str,
        message_id: &str,
        payload: Vec<u8>,
    ) {
        let mut headers = HeaderMap::new();
        headers.insert("Nats-Msg-Id", message_id);
        let acknowledgement = jetstream::new(self.client.clone())
            .publish_with_headers(subject, headers, payload.into())
            .await;
        acknowledgement
            .expect("NATS is there")
            .await
            .expect("NATS stores results");
    }
}
