//! Events: the record of every change, with its actor and its subject. They form the audit log and the feeds.

mod actor;
mod kinds;
mod parse_error;
mod subject;
mod visibility;

pub use actor::Actor;
pub use parse_error::ParseEventError;
pub use subject::Subject;

use faceoff_types::{
    DepartureKind, DivisionName, EvaluationId, IanaTimeZone, InvitationId, ProposalId, Retention,
    RoundNumber, RunId, ShardId, StageId, StageName, StageRules, StageSettings, SubmissionId, Task,
    TeamId, TeamName, TokenId, TournamentRules, TournamentSettings, UserName, WebhookId,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// The kind of a change, with its data. The serialised names of variants and fields are stored: new ones may be
/// added, old ones must stay, so a variant that is renamed in the code keeps its old name for `serde`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Event {
    /// The organiser invited a team.
    TeamCreated {
        /// The team's name at the invitation.
        name: TeamName,
    },
    /// The team got a new token; its earlier ones are revoked.
    TokenReplaced,
    /// A token was created for the subject.
    TokenCreated {
        token: TokenId,
        /// The token's label, chosen by its owner.
        name: String,
        /// When the token expires; `None`: never.
        expires_at: Option<Timestamp>,
    },
    /// A token got a new secret; the old one is invalid.
    TokenRotated {
        token: TokenId,
        /// The token's label, chosen by its owner.
        name: String,
    },
    TokenRevoked {
        token: TokenId,
        /// The token's label, chosen by its owner.
        name: String,
    },
    /// An invitation link was created.
    Invited {
        invitation: InvitationId,
        /// `organiser`, `member`, `founder` (of a new team) or `return` (an existing user gets access again).
        role: String,
        /// A note of its author, to recognise it in lists.
        note: String,
        expires_at: Timestamp,
    },
    /// An unused invitation link was revoked.
    InvitationRevoked {
        invitation: InvitationId,
    },
    /// A user accepted an invitation.
    #[serde(rename = "person_joined")]
    UserJoined {
        name: UserName,
        /// The team of a member; `None` for an organiser.
        team: Option<TeamId>,
    },
    /// The user changed their name, or an organiser did.
    #[serde(rename = "person_renamed")]
    UserRenamed {
        from: UserName,
        to: UserName,
    },
    /// The user's account was closed.
    #[serde(rename = "person_left")]
    UserLeft {
        name: UserName,
    },
    /// The user signed in in a browser.
    SignedIn,
    /// The user set a password.
    PasswordSet,
    /// The user accepted the terms.
    TermsAccepted {
        version: u32,
    },
    /// A new version of the terms was published.
    TermsPublished {
        /// From 1.
        version: u32,
    },
    /// The season's divisions were set.
    DivisionsSet {
        /// In display order.
        divisions: Vec<DivisionName>,
    },
    /// Registration of teams is open to everyone.
    RegistrationOpened,
    /// Teams can join by invitation only.
    RegistrationClosed,
    /// A registration was submitted.
    TeamRegistered {
        /// The requested team name.
        name: TeamName,
    },
    RegistrationApproved {
        team: TeamId,
    },
    RegistrationRefused {
        /// Shown to the person who registered.
        reason: String,
    },
    /// The team was renamed.
    TeamRenamed {
        from: TeamName,
        to: TeamName,
    },
    /// The team's profile was changed.
    TeamDescribed {
        affiliation: Option<String>,
        link: Option<String>,
        division: Option<DivisionName>,
    },
    /// The team became a baseline: a reference agent of the organisers, which no board ranks.
    TeamMadeBaseline,
    /// The team is ranked again and is no longer a baseline.
    TeamMadeRanked,
    /// The team retired from the season.
    TeamRetired,
    /// The team rejoined the season.
    TeamReturned,
    /// An announcement was published.
    Announced {
        title: String,
    },
    /// A team asked the organisers a question.
    Asked {
        team: TeamId,
    },
    /// The organisers answered a question.
    Answered {
        /// Are question and answer public?
        public: bool,
    },
    /// A bundle was uploaded, and its validation run is queued.
    SubmissionUploaded {
        team: TeamId,
        /// BLAKE3 of the bundle.
        bundle_blake3: String,
    },
    /// The validation run passed: the agent can be evaluated.
    SubmissionValid {
        /// The name in its manifest.
        agent_name: String,
    },
    /// The validation run failed by a fault of the submission.
    SubmissionInvalid {
        /// The fault and its location.
        reason: String,
    },
    /// The validation run was given up by a platform fault.
    SubmissionNotValidated {
        reason: String,
    },
    /// The submission became its team's active one, which is evaluated from the next cutoff on. It is the newest valid
    /// one, or the team's choice.
    SubmissionActivated,
    /// The submission was excluded from a day, because the stage does not accept its runtime.
    #[serde(rename = "submission_not_taken")]
    SubmissionExcluded {
        stage: StageId,
        day: Date,
        /// The runtimes that the stage accepts, and the submission's.
        reason: String,
    },
    /// The team withdrew the submission: it is not evaluated on later days.
    SubmissionWithdrawn,
    /// The submission's bundle was removed on request; its results stay.
    SubmissionDeleted {
        /// Shown to its team.
        reason: String,
    },
    /// The submission's bundle was removed, because it is not needed any more.
    #[serde(rename = "archive_removed")]
    BundleRemoved {
        reason: String,
    },
    /// The team set or removed the submission's label.
    SubmissionLabelled {
        /// `None` if the label was removed.
        label: Option<String>,
    },
    /// The team changed or removed the submission's note.
    SubmissionNoted,
    /// An evaluation of a submission was queued.
    EvaluationQueued {
        team: TeamId,
        submission: SubmissionId,
        /// The stage of the day; `None` for events from before there were stages.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stage: Option<StageId>,
        day: Date,
        run: RunId,
        /// The evaluation that is repeated.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rerun_of: Option<EvaluationId>,
    },
    /// The evaluation's first shard was claimed.
    EvaluationBegun,
    /// The evaluation's last shard was committed; scoring is queued.
    #[serde(rename = "evaluation_finalising")]
    EvaluationScoringStarted,
    /// The evaluation has a score and a dataset.
    EvaluationFinished {
        score: f64,
        /// BLAKE3 of the dataset's archive.
        dataset_blake3: String,
    },
    /// The evaluation ended without a score after too many agent faults.
    EvaluationAgentFailed,
    /// The evaluation was given up after platform faults.
    EvaluationPlatformFailed {
        reason: String,
    },
    EvaluationCancelled {
        /// Shown to the team.
        reason: String,
    },
    /// The day's deadline passed before the evaluation was complete.
    #[serde(rename = "evaluation_not_played")]
    EvaluationDeadlineMissed {
        /// Shown to the team.
        reason: String,
    },
    /// The evaluation's result no longer counts.
    EvaluationVoided {
        /// Public.
        reason: String,
    },
    /// The team published the evaluation's dataset.
    EvaluationPublished,
    /// The evaluation's dataset was removed; its result stays.
    DatasetRemoved {
        reason: String,
    },
    /// All results of a day were voided; each of its evaluations has its own event.
    DayVoided {
        /// Public.
        reason: String,
    },
    /// The team is neither evaluated nor ranked from now on.
    TeamDisqualified {
        /// Public.
        reason: String,
    },
    /// The team is evaluated and ranked again.
    TeamReinstated {
        reason: String,
    },
    /// An ablation of a submission was requested: its evaluation without perturbations, with each one alone, and with all.
    #[serde(rename = "ablation_ordered")]
    AblationRequested {
        submission: SubmissionId,
        /// Episodes of each task in each profile.
        episodes_per_task: u32,
    },
    /// All runs of the ablation are complete.
    AblationFinished,
    /// The ablation ended without a result.
    AblationFailed {
        /// The fault, and whether it is the agent's or the platform's.
        reason: String,
    },
    /// A proposal was queued: a trial, whose results never count, or a re-evaluation, whose results count once an
    /// organiser applies it.
    ProposalMade {
        stage: StageId,
        evaluations: u32,
        reason: String,
    },
    /// All evaluations of the proposal have ended.
    ProposalPlayed,
    /// The proposal's results count from now on; each of its evaluations has its own event.
    ProposalApplied,
    /// The proposal's results will never count.
    ProposalDropped,
    /// An evaluation of a proposal counts from now on.
    EvaluationApplied {
        proposal: ProposalId,
    },
    /// A shard (a part of a run's episodes) was played, and the outcomes of its episodes were stored.
    ShardCommitted {
        run: RunId,
        shard: ShardId,
        task: Task,
        first_episode: u32,
        /// One past the last episode.
        end_episode: u32,
        /// Number of episodes that ended by a fault of the agent.
        agent_faults: u32,
    },
    /// A job failed by a platform fault; it is retried, or was given up.
    #[serde(rename = "unit_given_back")]
    JobFailed {
        /// Id of the job, as in the server's log.
        #[serde(rename = "unit")]
        job: Uuid,
        /// Reported failures of this job so far.
        failures: u32,
        reason: String,
    },
    /// The day's cutoff: its evaluations were queued, each with its own event.
    DayStarted {
        /// Their number.
        evaluations: u32,
    },
    /// The day's deadline passed: its open evaluations were ended, each with its own event.
    DayOverdue {
        /// Number of evaluations that were ended.
        not_played: u32,
    },
    /// The day's seed is public from now on, because its last evaluation has ended. Events from before there were cutoffs have
    /// another cause: the day's first dataset was downloaded.
    DayReleased,
    /// A day that was missed on its date was started later.
    MissedDayStarted {
        /// Public.
        reason: String,
    },
    /// The evaluation is an extra one, beside the team's regular one of the day.
    #[serde(rename = "extra_turn_given")]
    ExtraEvaluationAdded {
        /// Public.
        reason: String,
    },
    /// The stage's boards are frozen in their current state.
    BoardsFrozen {
        /// Public.
        reason: String,
    },
    /// The stage's boards are updated again.
    BoardsUnfrozen,
    StageCreated {
        name: StageName,
        opens_at: Timestamp,
        /// `None`: no end is set.
        closes_at: Option<Timestamp>,
        /// Time zone of the stage's dates.
        zone: IanaTimeZone,
        /// Everything that scores depend on.
        rules: StageRules,
        /// Everything that scores do not depend on.
        settings: StageSettings,
    },
    /// The stage's name, times or settings were changed; all new values are given.
    StageChanged {
        name: StageName,
        opens_at: Timestamp,
        /// `None`: no end is set.
        closes_at: Option<Timestamp>,
        /// Time zone of the stage's dates.
        zone: IanaTimeZone,
        /// Everything that scores do not depend on.
        settings: StageSettings,
    },
    /// The retention of the stage's files was changed.
    StageRetentionChanged {
        retention: Retention,
    },
    /// The stage's rules were changed: at once, or from its opening on if it is not open yet.
    StageRulesChanged {
        /// From 1. Before the opening, a change replaces the rules of the same revision.
        revision: u32,
        rules: StageRules,
    },
    /// The cutoff of the stage's final day, the only day after its close. The day has its own event.
    StageFinalStarted {
        day: Date,
    },
    /// The stage is signed off: its results are final.
    StageFinalised,
    /// A tournament was created; test games and friendly games are possible.
    TournamentOpened {
        /// Tournaments have the same type of name as stages.
        name: StageName,
        /// Everything that results depend on.
        rules: Box<TournamentRules>,
        /// Everything that results do not depend on.
        settings: TournamentSettings,
        /// The teams at the opening.
        teams: Vec<TeamId>,
    },
    /// The tournament was changed; all new values are given.
    TournamentChanged {
        name: StageName,
        /// Everything that results depend on.
        rules: Box<TournamentRules>,
        /// Everything that results do not depend on.
        settings: TournamentSettings,
        /// The opponent in test games.
        baseline: Option<SubmissionId>,
    },
    /// No game of the tournament starts until it is resumed.
    TournamentPaused {
        /// Public.
        reason: String,
    },
    TournamentResumed,
    /// The tournament's results are final.
    TournamentClosed,
    /// Teams were added to the tournament.
    TeamsEntered {
        teams: Vec<TeamId>,
    },
    /// A team was removed from the tournament before its first round.
    #[serde(rename = "team_out")]
    EntrantRemoved {
        team: TeamId,
        /// Public.
        reason: String,
    },
    /// A team left the running tournament; each of its cancelled games has its own event.
    TeamLeftTournament {
        team: TeamId,
        left_as: DepartureKind,
        /// The first round in which its games do not count.
        from_round: RoundNumber,
        /// Public.
        reason: String,
    },
    /// The round's submissions are fixed, and its games are queued.
    RoundStarted {
        round: RoundNumber,
        games: u32,
    },
    /// The round's last game has ended.
    RoundOver {
        round: RoundNumber,
    },
    /// Replays of the schedule were requested; they do not count.
    #[serde(rename = "replays_ordered")]
    ScheduleReplaysRequested {
        times: u32,
        games: u32,
    },
    /// The replays that had not been played were cancelled.
    #[serde(rename = "replays_cancelled")]
    ScheduleReplaysCancelled {
        games: u32,
    },
    /// A test game or a friendly game was queued.
    #[serde(rename = "free_game_queued")]
    TestOrFriendlyGameQueued {
        team: TeamId,
        /// The opponent in a friendly game; `None`: a test game against the baseline.
        opponent: Option<TeamId>,
    },
    /// A slot started the game.
    GameBegun {
        /// From 1.
        attempt: u32,
    },
    /// The game has a result.
    GamePlayed {
        attempt: u32,
    },
    /// The game was given up after platform faults: it has no result.
    #[serde(rename = "game_broken")]
    GamePlatformFailed {
        reason: String,
    },
    /// The game's result no longer counts.
    GameVoided {
        /// Public.
        reason: String,
    },
    /// The game is to be played again.
    GameQueuedAgain,
    GameCancelled {
        /// Public.
        reason: String,
    },
    /// The team changed whether it accepts friendly games that other teams request.
    FriendlyGamesDeclined {
        /// False if it accepts them again.
        declines: bool,
    },
    WebhookCreated {
        webhook: WebhookId,
        /// The webhook's label, chosen by its owner.
        name: String,
    },
    /// The webhook's address, events or name were changed, or it was enabled again.
    WebhookChanged {
        webhook: WebhookId,
        /// The webhook's label, chosen by its owner.
        name: String,
    },
    /// The webhook got a new secret.
    WebhookRotated {
        webhook: WebhookId,
        /// The webhook's label, chosen by its owner.
        name: String,
    },
    /// The webhook was deleted by its owner.
    WebhookRemoved {
        webhook: WebhookId,
        /// The webhook's label, chosen by its owner.
        name: String,
    },
    /// The webhook was disabled, because its deliveries kept failing.
    #[serde(rename = "webhook_died")]
    WebhookDisabled {
        webhook: WebhookId,
        reason: String,
    },
    /// No job of the queue starts until it is resumed.
    QueuePaused {
        /// Public.
        reason: String,
    },
    QueueResumed,
    /// An organiser accepted that the system clock was set: from now on the server's time follows it again.
    ClockStepAccepted {
        /// How far the system clock was ahead of the server's time or behind it, as text.
        size: String,
    },
    /// Results of a remote worker are rejected from now on.
    WorkerBanned {
        /// Name of the worker.
        worker: String,
        reason: String,
        /// Number of shards, run by this worker, that are repeated.
        #[serde(rename = "again")]
        repeated_shards: u32,
    },
    /// Results of the remote worker are accepted again.
    WorkerReadmitted {
        worker: String,
    },
    /// The season was renamed.
    SeasonNamed {
        name: String,
    },
    /// The season is closed: its secret is public, and no evaluations start.
    SeasonClosed,
}

/// An event as it is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct EventRecord {
    /// Rises with every event of the data folder, in the order of the commits.
    pub id: i64,
    /// When the event was recorded, by the clock of the process that did so.
    pub at: Timestamp,
    pub actor: Actor,
    pub subject: Subject,
    pub event: Event,
}

/// A notification to this process's listeners.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// A stored event.
    Recorded(Box<EventRecord>),
    /// A job on the subject has made progress. This notification is not stored: it comes every second from every
    /// slot, each one replaces the last, and the final numbers are stored when the job ends.
    Progress(Subject),
}

impl Change {
    /// The subject whose data has changed.
    #[must_use]
    pub const fn subject(&self) -> Subject {
        match self {
            Self::Recorded(record) => record.subject,
            Self::Progress(subject) => *subject,
        }
    }
}
