//! HTTP. (contract stub)
#![expect(missing_docs, clippy::unimplemented, unused_variables, reason = "contract stub")]
use faceoff_store::{EvaluationPlan, Store};
#[derive(Debug, Clone)]
pub struct HttpConfig {
    pub max_bundle_bytes: u64,
    /// plan used by POST /api/v1/admin/days (start the day's evaluation)
    pub plan: EvaluationPlan,
    /// BLAKE3 of the organiser's bearer token
    pub admin_token_hash: [u8; 32],
    pub upload_dir: std::path::PathBuf,
}
pub fn router(store: Store, config: HttpConfig) -> axum::Router { unimplemented!() }
