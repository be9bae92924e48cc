//! The tables: rows as types, and changes of single rows. When a change may happen, and what else
//! changes with it, is the operations' business.

pub(crate) mod ablations;
pub(crate) mod active_submissions;
pub(crate) mod announcements;
pub(crate) mod archived;
pub(crate) mod bundles;
pub(crate) mod days;
pub(crate) mod divisions;
pub(crate) mod drafts;
pub(crate) mod entries;
pub(crate) mod episode_summaries;
pub(crate) mod evaluations;
pub(crate) mod events;
pub(crate) mod finalisations;
pub(crate) mod finalised;
pub(crate) mod freezes;
pub(crate) mod invitations;
pub(crate) mod measured;
pub(crate) mod people;
pub(crate) mod plan;
pub(crate) mod proposals;
pub(crate) mod questions;
pub(crate) mod registrations;
pub(crate) mod retentions;
pub(crate) mod rulings;
pub(crate) mod runs;
pub(crate) mod season;
pub(crate) mod shards;
pub(crate) mod smoke_runs;
pub(crate) mod stage_runtimes;
pub(crate) mod stages;
pub(crate) mod standings;
pub(crate) mod submissions;
pub(crate) mod teams;
pub(crate) mod terms;
pub(crate) mod tokens;
