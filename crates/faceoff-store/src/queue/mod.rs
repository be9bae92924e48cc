//! The job queue. A worker claims a job and gets a lease of some seconds, which it renews until the job is released or
//! done. The purpose of a job is in the tables that refer to it. To the queue, its kind and its owner are
//! opaque labels. Slot time is shared fairly: first among the lanes (queues for one class of jobs) of the smallest urgency value, then
//! among the accounts of a lane, one for each owner (a team or a tournament) with jobs.

mod due_times;
pub(crate) mod forecast;
mod jobs;
mod lease;
mod shares;

pub(crate) use due_times::{shift_due_times, shorten_due_times};
pub(crate) use jobs::{
    LeasedJob, NewJob, QueueGauges, claim_next, drop_jobs, end_leases, gauges, insert, requeue,
    wake_workers,
};
pub use lease::JobClaim;
pub(crate) use lease::{
    ClaimState, ReleaseCause, claim_state, is_holder, is_leased, lease_holder, leases, mark_done,
    park, release, renew, renew_all_leases, renew_leases, requeue_failed, transfer, unpark,
};
pub(crate) use shares::{Lane, SlotTimeAccount, open_account};
