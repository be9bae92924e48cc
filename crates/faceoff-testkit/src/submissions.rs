//! Teams, their submissions, and the outcome of validation runs.

use faceoff_store::{Actor, ClaimedJob, Job, Requester, Store, Submission, Team, UploadQuota};
use faceoff_types::{BundleRef, TeamId, ValidationOutcome};
use jiff::Timestamp;

/// Duration of the lease of a validation run, which is committed at the time at which it is claimed.
const LEASE_S: u32 = 60;

/// Creates a team. The hash of its token is the hash of its name.
pub async fn create_team(store: &Store, name: &str, now: Timestamp) -> Team {
    let token_hash = *blake3::hash(name.as_bytes()).as_bytes();
    store
        .create_team(
            Actor::Operator,
            &name.parse().unwrap(),
            token_hash,
            Requester::default(),
            now,
        )
        .await
        .unwrap()
}

/// A bundle with this content, to be stored under `key`.
pub fn bundle_ref(key: impl Into<String>, content: &[u8]) -> BundleRef {
    BundleRef {
        key: key.into(),
        bytes: content.len() as u64,
        blake3: blake3::hash(content).to_string(),
        file_name: "agent.tar.gz".into(),
    }
}

/// Submits a bundle as a team, which queues its validation run. Does not write the bundle's file.
pub async fn submit(store: &Store, team: TeamId, bundle: BundleRef, now: Timestamp) -> Submission {
    let quota = UploadQuota::default();
    store
        .create_submission(Actor::Team(team), team, bundle, &quota, now)
        .await
        .unwrap()
}

/// The outcome of the validation run of a valid agent.
pub fn valid_outcome(runtime: &str, agent_name: &str, log: &str) -> ValidationOutcome {
    ValidationOutcome::Valid {
        runtime: runtime.into(),
        agent_name: agent_name.into(),
        timing: Vec::new(),
        log: log.into(),
    }
}

/// Claims the next job, which must be a validation run, and commits its outcome. Returns the submission as it is then.
pub async fn finish_validation(
    store: &Store,
    outcome: ValidationOutcome,
    now: Timestamp,
) -> Submission {
    let claimed = store.claim("slot 0", LEASE_S, now).await.unwrap();
    let ClaimedJob { claim, job } = claimed.expect("a validation run is queued");
    let Job::Validation { submission, .. } = job else {
        panic!("expected a validation run, claimed {job:?}");
    };
    store.commit_validation(&claim, outcome, now).await.unwrap();
    store.submission(submission.id).await.unwrap()
}
