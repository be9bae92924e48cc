//! Worker. (contract stub)
#![expect(missing_docs, clippy::unimplemented, unused_variables, reason = "contract stub")]
use faceoff_runner::{AgentEnvironment, bundle::BundleLimits};
use faceoff_store::{EvaluationPlan, Store};
use std::path::PathBuf;
use tokio_util::sync::CancellationToken;

#[derive(Debug, Clone)]
pub struct WorkerConfig {
    pub slots: usize, pub lease_s: u32, pub scratch_dir: PathBuf,
    pub agent: AgentEnvironment, pub bundle_limits: BundleLimits,
}
/// Runs `slots` named OS threads until cancelled; returns after every slot has given its unit back or finished it.
pub async fn run(store: Store, config: WorkerConfig, shutdown: CancellationToken) -> anyhow::Result<()> { unimplemented!() }
/// The daily schedule: calls store.start_day each UTC day at `at`.
pub async fn run_schedule(store: Store, plan: EvaluationPlan, at: jiff::civil::Time, shutdown: CancellationToken) -> anyhow::Result<()> { unimplemented!() }
