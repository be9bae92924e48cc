//! Remote workers, which run jobs on other machines. The store's queue stays the only queue: the server claims as many jobs
//! as free remote slots request, and NATS (a message broker, which stores messages in *streams*) carries jobs to the workers
//! and results back.
//!
//! A job's lease (the right to run it for a time) alone decides which slot has the job. A job that NATS loses is
//! released earlier, or when its lease expires, and is sent again. A job that NATS delivers twice is started once, by
//! the first worker that asks to start it, and committed once.
//!
//! For both sides, `names.rs` has the names of streams and subjects, and `connection.rs` the connection to NATS.
//!
//! The server's side:
//! * `streams.rs` sets up the streams;
//! * `dispatch.rs` publishes jobs, with access to files by `grants.rs` or `bucket.rs`; `published_jobs.rs` keeps track of
//!   published jobs that no worker has started;
//! * `requests.rs` answers requests of workers; `compatibility.rs` decides which workers get jobs;
//! * `accepted_results.rs` accepts results after the checks of `result_checks.rs`; `pending_results.rs` keeps track of
//!   results that have not been accepted.
//!
//! The worker's side:
//! * `worker.rs` is the process, and `worker_link.rs` the connection that its slots share;
//! * `server_client.rs` is the server as its slots see it: `next_job.rs` receives jobs, `job_files.rs` and `transfer.rs`
//!   transfer files, and `result_sender.rs` sends results;
//! * `connection_check.rs` checks in advance whether a worker would get jobs.

mod accepted_results;
mod bucket;
mod compatibility;
mod connection;
mod connection_check;
mod dispatch;
mod grants;
mod job_files;
mod names;
mod next_job;
mod pending_results;
mod published_jobs;
mod requests;
mod result_checks;
mod result_sender;
mod server_client;
mod streams;
mod transfer;
mod unfinished_checks;
mod worker;
mod worker_link;

pub use bucket::BucketConfig;
pub use connection::NatsConfig;
pub use connection_check::{ConnectionCheck, check_connection};
pub use dispatch::{RemoteConfig, dispatch};
pub use worker::{RemoteWorkerConfig, run_remote_worker};
