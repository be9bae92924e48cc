//! The vocabulary of Faceoff: ids, names, tasks, profiles, seeds, tiers, faults and scores.
//!
//! Values are parsed once, at a boundary (serde, command line, SQL), and trusted afterwards.
//! This crate does no I/O, reads no clock and holds no policy: rules live in `faceoff-scoring`,
//! physics in `faceoff-sim`.

mod action_space;
mod agent_task;
mod archive_format;
mod bundle_ref;
mod clock;
mod competition;
mod computation_time;
mod day_deadline;
mod departure_kind;
pub mod deprecated_names;
mod fault;
mod full_disk;
mod game;
mod game_limits;
mod game_seed_label;
mod idempotency_key;
mod ids;
mod invalid_stage_rules;
mod limits;
mod live_game;
mod look_alikes;
mod magnitudes;
mod millionths;
mod names;
mod outcome;
mod printable;
mod profile;
mod recording;
mod result;
mod retention;
mod round_number;
mod ruleset;
mod runtime_inventory;
mod runtimes;
mod schedule;
mod seed;
mod seed_label;
mod short_name;
#[cfg(feature = "sqlx")]
mod sqlite;
mod stage;
mod stage_limits;
mod stage_settings;
mod task;
mod task_weights;
mod tier;
mod time_zone;
mod timing;
mod tournament_format;
mod tournament_rules;
mod unknown_profile;
mod unknown_task;
mod url_without_password;
mod validation_outcome;
mod variation;
mod violation;
mod worker_name;

pub use action_space::{ActionLayout, ActionSpace};
pub use agent_task::{AgentTask, Side};
pub use archive_format::ArchiveFormat;
pub use bundle_ref::BundleRef;
pub use clock::{Clock, ClockStart, ClockStep, StepCause};
pub use competition::{Competition, EndInfo, ProfileInfo, RulesetInfo, TaskInfo, ViolationInfo};
pub use computation_time::ComputationTime;
pub use day_deadline::{DayDeadline, MAX_DEADLINE_H, ParseDayDeadlineError};
pub use departure_kind::DepartureKind;
pub use deprecated_names::DeprecatedNames;
pub use fault::{AgentFault, AgentFaultKind, Phase};
pub use full_disk::is_full_disk;
pub use game::*;
pub use game_limits::GameLimits;
pub use game_seed_label::{GameSeedLabel, ParseGameSeedLabelError};
pub use idempotency_key::{IdempotencyKey, InvalidIdempotencyKey};
pub use ids::{
    AblationId, AnnouncementId, DeliveryId, EvaluationId, GameId, InvitationId, ParseIdError,
    ProposalId, QuestionId, RegistrationId, RunId, ShardId, StageId, SubmissionId, TeamId, TokenId,
    TournamentId, UserId, WebhookId,
};
pub use invalid_stage_rules::{InvalidStageRules, MAX_MEAN_DAYS};
pub use limits::{AgentLimits, BundleLimits, ResourceLimits, TimeLimits};
pub use live_game::{GameEvent, LiveEvent, LiveGame, LivePosition};
pub use magnitudes::{InvalidMagnitude, Magnitude, MagnitudeInfo, Magnitudes};
pub use millionths::{Millionths, NotMillionths};
pub use names::{DivisionName, InvalidName, StageName, TeamName, UserName, name_skeleton};
pub use outcome::{EpisodeEnd, EpisodeOutcome};
pub use printable::{escape_unprintable, is_printable, printable_excerpt};
pub use profile::{Profile, ProfileMap};
pub use recording::{RecordingColumn, RecordingColumns};
pub use result::{ComputationTimeSummary, EvaluationResult, TaskResult};
pub use retention::{InvalidRetention, MAX_DAYS_AFTER_SIGN_OFF, MAX_KEPT_EVALUATIONS, Retention};
pub use round_number::{InvalidRoundNumber, RoundNumber};
pub use ruleset::{ACTION_LIMIT, Ruleset, UnknownRuleset};
pub use runtime_inventory::{AgentMachine, PythonInventory, RuntimeContent, RuntimeInventory};
pub use runtimes::{IMAGE_RUNTIME, InvalidRuntimes, RuntimeRefused, Runtimes, StageRuntimes};
pub use schedule::{InvalidSchedule, Schedule};
pub use seed::{ParseSeedError, Seed};
pub use seed_label::{ParseSeedLabelError, SeedLabel};
pub use short_name::InvalidShortName;
pub use stage::{ParseStageDayError, StageDay, StageRules};
pub use stage_limits::{InvalidLimit, StageLimits, StageUploadLimits};
pub use stage_settings::{CountingResult, Publication, StageSettings, UnknownSetting};
pub use task::{CONTROL_STEP_S, EPISODE_STEPS, MAX_EPISODES_PER_TASK, Task, TaskMap};
pub use task_weights::{InvalidWeights, TaskWeights};
pub use tier::Tier;
pub use time_zone::{IanaTimeZone, UnknownTimeZone};
pub use timing::{RoundTrips, SlotTiming};
pub use tournament_format::TournamentFormat;
pub use tournament_rules::{
    InvalidTournament, MAX_GAME_STEPS, MAX_TEST_AND_FRIENDLY_GAMES, TournamentRules,
    TournamentSettings, Withdrawals,
};
pub use unknown_profile::UnknownProfile;
pub use unknown_task::UnknownTask;
pub use url_without_password::url_without_password;
pub use validation_outcome::{ValidationOutcome, ValidationTiming, ViolatedLimit};
pub use variation::{InvalidTierBounds, TierBounds, Variation};
pub use violation::{ViolationCounts, ViolationName, Violations};
pub use worker_name::{ParseWorkerNameError, WorkerName};
