//! The vocabulary of Faceoff: ids, names, tasks, profiles, seeds, tiers, faults and scores.
//!
//! Everything here parses once, at a boundary (serde, command line, SQL), and is trusted afterwards.
//! This crate does no I/O, reads no clock and holds no policy: rules live in `faceoff-scoring`,
//! physics in `faceoff-sim`.

mod computation_time;
mod constraint;
mod fault;
mod ids;
mod outcome;
mod profile;
mod result;
mod ruleset;
mod seed;
mod seed_label;
mod task;
mod team_name;
mod tier;
mod timing;

pub use computation_time::ComputationTime;
pub use constraint::{Constraint, Violations};
pub use fault::{AgentFault, AgentFaultKind};
pub use ids::{AblationId, EvaluationId, ParseIdError, RunId, ShardId, SubmissionId, TeamId};
pub use outcome::{EpisodeEnd, EpisodeOutcome};
pub use profile::{Factor, Factors, ParseProfileError, Profile};
pub use result::{ComputationTimeSummary, EvaluationResult, TaskResult, ViolationCounts};
pub use ruleset::RULESET;
pub use seed::{ParseSeedError, Seed};
pub use seed_label::{ParseSeedLabelError, SeedLabel};
pub use task::{MAX_EPISODES_PER_TASK, ParseTaskError, Task};
pub use team_name::{InvalidTeamName, TeamName};
pub use tier::Tier;
pub use timing::{RoundTrips, SlotTiming};
