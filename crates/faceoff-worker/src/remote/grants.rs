//! Grants for remote jobs, and the acceptance of results within their grant. A *grant* is sealed by the server and says which
//! files the worker of a job may read and write.

use super::result_checks::ResultChecks;
use crate::{
    local::LocalServer,
    server::{JobServer, LeaseStatus, ReleaseReason},
};
use faceoff_store::StoreError;
use faceoff_wire::{
    grant::{ExpectedRecording, Grant, GrantKey, WriteScope},
    job::{JobPayload, JobReport, JobSpec, Lease, OutputFiles},
    remote::{RemoteJobEnd, ResultMessage},
};

/// The grant for a job. `program_blake3` is the hash of the server's program, which the worker must have, too.
pub(super) fn grant_for(job: &JobSpec, program_blake3: &str) -> Grant {
    let (bundles, write_scope, expected_recording) = match &job.payload {
        JobPayload::Shard {
            agent,
            output,
            spec,
            ..
        } => {
            let (write_scope, expected_recording) = match output {
                OutputFiles::None => (WriteScope::None, ExpectedRecording::None),
                OutputFiles::Clips(key) => (WriteScope::File(key.clone()), ExpectedRecording::None),
                OutputFiles::Recording(key) => (
                    WriteScope::Folder(key.clone()),
                    ExpectedRecording::Shard(spec.clone()),
                ),
            };
            (vec![agent.bundle.clone()], write_scope, expected_recording)
        }
        JobPayload::Game {
            agents,
            recording,
            spec,
            ..
        } => {
            let bundles = agents.each_ref().map(|agent| agent.bundle.clone());
            let (write_scope, expected_recording) = match recording {
                Some(key) => (
                    WriteScope::Folder(key.clone()),
                    ExpectedRecording::Game(spec.clone()),
                ),
                None => (WriteScope::None, ExpectedRecording::None),
            };
            (bundles.into(), write_scope, expected_recording)
        }
        // These jobs run on the server's own slots only (`docs/workers.md`).
        JobPayload::Validation { .. } | JobPayload::Scoring { .. } => {
            (Vec::new(), WriteScope::None, ExpectedRecording::None)
        }
    };
    Grant {
        job_id: job.lease.job_id,
        nonce: job.lease.nonce,
        bundles,
        write_scope,
        expected_recording,
        program_blake3: program_blake3.to_owned(),
    }
}

/// The outcome of processing a result message.
pub(super) enum Acceptance {
    Accepted,
    /// The worker does not have the lease.
    LeaseLost,
    /// The result has another form than its job demands, e.g. other episodes; the job is released as after a platform fault.
    JobMismatch,
    /// The recording differs from what the simulator computes for the recorded actions. The text, for organisers, names the difference.
    SimulationMismatch(String),
    /// Some of the result's files are still being uploaded.
    FilesPending,
    /// The result was not checked, since too many earlier checks of it did not end.
    Unchecked,
}

impl From<LeaseStatus> for Acceptance {
    fn from(status: LeaseStatus) -> Self {
        match status {
            LeaseStatus::Held => Self::Accepted,
            LeaseStatus::Lost => Self::LeaseLost,
        }
    }
}

/// The grant of a result message, if it is valid and matches the lease.
pub(super) fn open_grant(message: &ResultMessage, key: &GrantKey) -> Option<Grant> {
    let lease = &message.lease;
    Grant::open(&message.grant, key)
        .filter(|grant| grant.job_id == lease.job_id && grant.nonce == lease.nonce)
}

/// Stores a result within its grant, if it passes the checks. A result that does not match its job is handled as a
/// platform fault and affects no other job.
pub(super) fn store_result(
    server: &LocalServer,
    checks: &ResultChecks,
    grant: &Grant,
    message: ResultMessage,
) -> anyhow::Result<Acceptance> {
    let ResultMessage { lease, end, .. } = message;
    let released = match end {
        RemoteJobEnd::Done { report } => {
            return store_report(server, checks, grant, &lease, *report);
        }
        RemoteJobEnd::Interrupted => server.release(&lease, ReleaseReason::Interrupted),
        RemoteJobEnd::FullDisk => server.release(&lease, ReleaseReason::FullDisk),
        RemoteJobEnd::PlatformFault { reason } => {
            server.release(&lease, ReleaseReason::PlatformFault(&reason))
        }
    };
    released.map(|()| Acceptance::Accepted)
}

fn store_report(
    server: &LocalServer,
    checks: &ResultChecks,
    grant: &Grant,
    lease: &Lease,
    report: JobReport,
) -> anyhow::Result<Acceptance> {
    if !matches_grant(&report, grant) {
        tracing::error!(job = %lease.job_id, slot = lease.holder, "a worker's report does not match its job");
        let reason = ReleaseReason::PlatformFault("a worker's report did not match its job");
        server.release(lease, reason)?;
        return Ok(Acceptance::JobMismatch);
    }
    // If the lease has ended, the result is already stored or will be refused. It is not checked, since its files may be gone.
    if server.is_held(lease)? {
        if !server.live.workers.close_files(lease.nonce) {
            return Ok(Acceptance::FilesPending);
        }
        if let Some(difference) =
            checks.find_difference(grant, &report, server.store.artifacts())?
        {
            return Ok(Acceptance::SimulationMismatch(difference));
        }
    }
    match server.commit(lease, report) {
        Ok(status) => Ok(status.into()),
        // A retry would be refused again.
        Err(error) if matches!(error.downcast_ref(), Some(StoreError::Conflict(_))) => {
            tracing::error!(job = %lease.job_id, slot = lease.holder, %error, "a worker's report is not acceptable");
            let reason = "a worker's report does not match its job";
            server.release(lease, ReleaseReason::PlatformFault(reason))?;
            Ok(Acceptance::JobMismatch)
        }
        Err(error) => Err(error),
    }
}

/// Does the report name only files that its grant allows?
fn matches_grant(report: &JobReport, grant: &Grant) -> bool {
    match (report, &grant.write_scope) {
        (
            JobReport::Shard {
                recording: Some(key),
                ..
            },
            WriteScope::Folder(granted_key),
        ) => key == granted_key,
        (
            JobReport::Shard {
                recording: None, ..
            },
            WriteScope::None | WriteScope::File(_),
        ) => true,
        (
            JobReport::Game {
                recording: Some(files),
                ..
            },
            WriteScope::Folder(granted_key),
        ) => files.key == *granted_key,
        (
            JobReport::Game {
                recording: None, ..
            },
            WriteScope::None,
        ) => true,
        _ => false,
    }
}
