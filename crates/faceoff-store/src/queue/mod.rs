//! The queue of work: units that are claimed by a lease of seconds, renewed, handed back or done.
//! What a unit is for is written in the tables that refer to it; its kind is a label that the queue
//! hands through, and so is whoever its slot time is charged to.

pub(crate) mod forecast;
mod lease;
mod shares;
mod units;

pub use lease::Claim;
pub(crate) use lease::{
    Hold, hand_over, hold, holder_of, is_holder, is_leased, leases_of, mark_done, park, release,
    renew, renew_all, renew_of, requeue_failed, unpark,
};
pub(crate) use shares::{Account, Lane, account};
pub(crate) use units::{
    Leased, NewUnit, Standing, claim_next, drop_units, end_leases_of, goes_on, insert, queue_again,
    standing,
};
