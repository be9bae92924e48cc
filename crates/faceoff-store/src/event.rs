//! What is recorded of every change: who did what to what. The audit log, and what feeds read.

mod actor;
mod kinds;
mod parse;
mod public;
mod subject;

pub use actor::Actor;
pub use parse::ParseEventError;
pub use subject::Subject;

use faceoff_types::{
    DivisionName, EvaluationId, InvitationId, LeftAs, PersonName, ProposalId, Retention,
    RoundNumber, RunId, ShardId, StageId, StageName, StageRules, StageSettings, SubmissionId, Task,
    TeamId, TeamName, TokenId, TournamentRules, TournamentSettings, WebhookId, Zone,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// What happened. The variants' names and fields are stored: new ones may be added, old ones stay.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Event {
    /// The organiser invited a team.
    TeamCreated {
        /// As it was at the invitation.
        name: TeamName,
    },
    /// The team has another token; all that it had are void.
    TokenReplaced,
    /// The subject has another token.
    TokenCreated {
        token: TokenId,
        /// What its owner calls it.
        name: String,
        /// From then on it is worth nothing.
        expires_at: Option<Timestamp>,
    },
    /// A token has another secret; the old one is void.
    TokenRotated {
        token: TokenId,
        /// What its owner calls it.
        name: String,
    },
    /// A token is worth nothing any more.
    TokenRevoked {
        token: TokenId,
        /// What its owner calls it.
        name: String,
    },
    /// Somebody may join by a link.
    Invited {
        invitation: InvitationId,
        /// `organiser`, `member`, `founder` or `return`.
        role: String,
        note: String,
        /// From then on it is worth nothing.
        expires_at: Timestamp,
    },
    /// The link is worth nothing any more.
    InvitationRevoked {
        invitation: InvitationId,
    },
    /// They followed a link.
    PersonJoined {
        /// As they are called.
        name: PersonName,
        /// Whose member they are; none: an organiser.
        team: Option<TeamId>,
    },
    /// They may do nothing any more.
    PersonLeft {
        /// As they were called.
        name: PersonName,
    },
    /// They signed in on a page.
    SignedIn,
    /// They have another password.
    PasswordSet,
    /// They accepted the terms.
    TermsAccepted {
        version: u32,
    },
    /// There are other terms.
    TermsPublished {
        /// From 1.
        version: u32,
    },
    /// Teams can be in these.
    DivisionsSet {
        /// In their order.
        divisions: Vec<DivisionName>,
    },
    /// Anybody may register a team.
    RegistrationOpened,
    /// Teams come by invitation only.
    RegistrationClosed,
    /// A team wants to take part.
    TeamRegistered {
        /// What it wants to be called.
        name: TeamName,
    },
    RegistrationApproved {
        team: TeamId,
    },
    RegistrationRefused {
        /// As who registered may read it.
        reason: String,
    },
    /// The team has another name.
    TeamRenamed {
        from: TeamName,
        to: TeamName,
    },
    /// The team tells something else of itself.
    TeamDescribed {
        /// Where it is from.
        affiliation: Option<String>,
        link: Option<String>,
        /// The division that it is in.
        division: Option<DivisionName>,
    },
    /// The team is a reference agent of the organisers from now on, which no board ranks.
    TeamMadeBaseline,
    /// The team is ranked as others are, and no baseline any more.
    TeamMadeRanked,
    /// The team plays no more, by its own wish.
    TeamRetired,
    /// The team plays again.
    TeamReturned,
    /// Everybody was told something.
    Announced {
        /// What it is called.
        title: String,
    },
    Asked {
        team: TeamId,
    },
    /// The organisers have answered.
    Answered {
        /// May everybody read it?
        public: bool,
    },
    /// A bundle came, and its smoke run is queued.
    SubmissionUploaded {
        team: TeamId,
        /// BLAKE3 of the archive.
        bundle_blake3: String,
    },
    /// The smoke run found that the agent can be evaluated.
    SubmissionValid {
        /// The name in its manifest.
        agent_name: String,
    },
    /// The smoke run found a fault of the team's.
    SubmissionInvalid {
        /// What is wrong and where.
        reason: String,
    },
    /// The smoke run could not be done, by our fault.
    SubmissionNotValidated {
        reason: String,
    },
    /// It is what its team enters at the next cut: the newest that is valid, or the team's choice.
    SubmissionActivated,
    /// It does not play a day, since the stage does not take its runtime.
    SubmissionNotTaken {
        stage: StageId,
        day: Date,
        /// What the stage takes, and what came.
        reason: String,
    },
    /// Its team has taken it back: it enters no further day.
    SubmissionWithdrawn,
    /// Its archive is removed; what it has played stays.
    SubmissionDeleted {
        /// As its team reads it.
        reason: String,
    },
    /// Nobody plays it any more, and its archive is removed.
    ArchiveRemoved {
        reason: String,
    },
    /// Its team calls it so.
    SubmissionLabelled {
        /// None any more, if it is null.
        label: Option<String>,
    },
    /// Its team has written something else about it, or nothing any more.
    SubmissionNoted,
    /// A submission is to play a day.
    EvaluationQueued {
        team: TeamId,
        submission: SubmissionId,
        /// Whose day; unknown of those from before there were stages.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stage: Option<StageId>,
        day: Date,
        run: RunId,
        /// The evaluation that is played again.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rerun_of: Option<EvaluationId>,
    },
    /// Its first shard was claimed.
    EvaluationBegun,
    /// Its last shard was committed; scoring is queued.
    EvaluationFinalising,
    /// Score and dataset are there.
    EvaluationFinished {
        score: f64,
        /// BLAKE3 of the dataset's archive.
        dataset_blake3: String,
    },
    /// Too many agent faults; no score.
    EvaluationAgentFailed,
    /// Our fault, given up.
    EvaluationPlatformFailed {
        reason: String,
    },
    EvaluationCancelled {
        /// As it was told to the team.
        reason: String,
    },
    /// Its day's deadline came before it was played; the turn is given back.
    EvaluationNotPlayed {
        /// As it was told to the team.
        reason: String,
    },
    /// Its result does not count any more; the turn is given back.
    EvaluationVoided {
        /// As everybody may read it.
        reason: String,
    },
    /// Its team has made its dataset public.
    EvaluationPublished,
    /// Its dataset is removed; its result stays.
    DatasetRemoved {
        reason: String,
    },
    /// All of a day does not count any more; each of its evaluations has an event of its own.
    DayVoided {
        /// As everybody may read it.
        reason: String,
    },
    /// It neither plays nor is ranked from now on.
    TeamDisqualified {
        /// As everybody may read it.
        reason: String,
    },
    /// It plays and is ranked again.
    TeamReinstated {
        reason: String,
    },
    /// A submission is to be taken apart, profile by profile.
    AblationOrdered {
        submission: SubmissionId,
        /// Of each task in each profile.
        episodes_per_task: u32,
    },
    /// All of its runs are played.
    AblationFinished,
    /// It ended without a result.
    AblationFailed {
        /// Whose fault it was and which.
        reason: String,
    },
    /// Evaluations are to be played without counting.
    ProposalMade {
        stage: StageId,
        evaluations: u32,
        reason: String,
    },
    /// All of its evaluations are over.
    ProposalPlayed,
    /// What it has played counts; each of its evaluations has an event of its own.
    ProposalApplied,
    /// What it has played will never count.
    ProposalDropped,
    /// It was played as a part of a proposal, and counts from now on.
    EvaluationApplied {
        proposal: ProposalId,
    },
    /// Episodes were played and their outcomes stored.
    ShardCommitted {
        /// What they are a part of.
        run: RunId,
        shard: ShardId,
        task: Task,
        /// The first one.
        first_episode: u32,
        /// One past the last one.
        end_episode: u32,
        /// Episodes that ended by a fault of the agent.
        agent_faults: u32,
    },
    /// A fault of ours: the unit of work will be tried again, or was given up.
    UnitGivenBack {
        /// The unit, as the server's log names it.
        unit: Uuid,
        /// Reported failures of this unit so far.
        failures: u32,
        reason: String,
    },
    /// The cut of a day: its evaluations were queued, each with an event of its own.
    DayStarted {
        evaluations: u32,
    },
    /// The day's deadline has come: what was left of it is ended, each with an event of its own.
    DayOverdue {
        /// How many were not played.
        not_played: u32,
    },
    /// The day's seed is public: its last evaluation has ended (before there were cuts: its first
    /// dataset was handed out).
    DayReleased,
    /// A day that was missed on its date starts after all.
    MissedDayStarted {
        /// As everybody may read it.
        reason: String,
    },
    /// It is a turn beside the day's own.
    ExtraTurnGiven {
        /// As everybody may read it.
        reason: String,
    },
    /// The stage's boards show from now on what they show now.
    BoardsFrozen {
        /// As everybody may read it.
        reason: String,
    },
    /// The stage's boards show everything again.
    BoardsUnfrozen,
    /// The season has another stage.
    StageCreated {
        /// As it was then.
        name: StageName,
        /// From when on its days start.
        opens_at: Timestamp,
        /// Until when; none: it has no end yet.
        closes_at: Option<Timestamp>,
        /// Where its days are dates.
        zone: Zone,
        /// What scores depend on.
        rules: StageRules,
        /// What they do not depend on.
        settings: StageSettings,
    },
    /// The stage's name, times or settings are others: all of them as they are now.
    StageChanged {
        name: StageName,
        /// From when on its days start.
        opens_at: Timestamp,
        /// Until when; none: it has no end yet.
        closes_at: Option<Timestamp>,
        /// Where its days are dates.
        zone: Zone,
        /// What no score depends on.
        settings: StageSettings,
    },
    /// The stage keeps other files of what it has played.
    StageRetentionChanged {
        /// From now on.
        retention: Retention,
    },
    /// The stage has other rules from now on; before it opens, from its opening on.
    StageRulesChanged {
        /// From 1; before the opening, the one that there was.
        revision: u32,
        rules: StageRules,
    },
    /// Its one day after the close has had its cut; the day has an event of its own.
    StageFinalStarted {
        day: Date,
    },
    /// Its result is signed off: nothing of it changes any more.
    StageFinalised,
    /// The season has another tournament.
    TournamentOpened {
        /// As it was then.
        name: StageName,
        /// What results depend on.
        rules: Box<TournamentRules>,
        /// What they do not depend on.
        settings: TournamentSettings,
        /// Its first teams.
        teams: Vec<TeamId>,
    },
    /// It is otherwise: all of it as it is now.
    TournamentChanged {
        name: StageName,
        /// What results depend on.
        rules: Box<TournamentRules>,
        /// What they do not depend on.
        settings: TournamentSettings,
        /// The agent to test against.
        baseline: Option<SubmissionId>,
    },
    /// No game of it begins from now on.
    TournamentPaused {
        /// As everybody may read it.
        reason: String,
    },
    /// Its games begin again.
    TournamentResumed,
    /// Nothing of it changes any more.
    TournamentClosed,
    /// Teams are in it from now on.
    TeamsEntered {
        teams: Vec<TeamId>,
    },
    /// A team is not in it any more, before anything was played.
    TeamOut {
        team: TeamId,
        /// As everybody may read it.
        reason: String,
    },
    /// A team plays no more in it; each of its games that is called off has an event of its own.
    TeamLeftTournament {
        team: TeamId,
        left_as: LeftAs,
        /// The first round whose games with it do not count.
        from_round: RoundNumber,
        /// As everybody may read it.
        reason: String,
    },
    /// What its teams have active is fixed, and its games are queued.
    RoundStarted {
        round: RoundNumber,
        games: u32,
    },
    /// The last of its games has ended.
    RoundOver {
        round: RoundNumber,
    },
    /// The schedule is to be played again, without counting.
    ReplaysOrdered {
        times: u32,
        games: u32,
    },
    /// What was not played of it is called off.
    ReplaysCancelled {
        games: u32,
    },
    /// A game that does not count waits.
    FreeGameQueued {
        team: TeamId,
        /// Against whom; none: the baseline.
        opponent: Option<TeamId>,
    },
    /// A slot plays it.
    GameBegun {
        /// Which attempt, from 1.
        attempt: u32,
    },
    /// It has a result.
    GamePlayed {
        attempt: u32,
    },
    /// Our fault, given up: it has no result.
    GameBroken {
        reason: String,
    },
    /// Its result counts no more.
    GameVoided {
        /// As everybody may read it.
        reason: String,
    },
    /// It is to be played again.
    GameQueuedAgain,
    /// It is not played.
    GameCancelled {
        /// As everybody may read it.
        reason: String,
    },
    /// Does the team play no friendly games that others ask for?
    FriendlyGamesDeclined {
        /// Or does it again.
        declines: bool,
    },
    /// A program is told of what happens.
    WebhookCreated {
        webhook: WebhookId,
        /// What its owner calls it.
        name: String,
    },
    /// It is somewhere else, told of something else, called otherwise, or told again.
    WebhookChanged {
        webhook: WebhookId,
        /// What its owner calls it.
        name: String,
    },
    /// It has another secret.
    WebhookRotated {
        webhook: WebhookId,
        /// What its owner calls it.
        name: String,
    },
    /// It is told nothing any more, by its owner's wish.
    WebhookRemoved {
        webhook: WebhookId,
        /// What its owner called it.
        name: String,
    },
    /// It is told nothing any more, since it takes nothing.
    WebhookDied {
        webhook: WebhookId,
        reason: String,
    },
    /// Nothing of the queue is begun from now on.
    QueuePaused {
        /// As everybody may read it.
        reason: String,
    },
    /// The queue goes on.
    QueueResumed,
    /// Nothing is taken of a worker on another machine any more.
    WorkerBanned {
        /// What it is called.
        worker: String,
        reason: String,
        /// How many shards that it played are played again.
        again: u32,
    },
    /// A worker's work is taken again.
    WorkerReadmitted {
        /// What it is called.
        worker: String,
    },
    /// The season has another name.
    SeasonNamed {
        name: String,
    },
    /// The secret is public and nothing more is evaluated.
    SeasonClosed,
}

/// An event as it is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct EventRecord {
    /// Rises with every event of the data folder, in the order of the commits.
    pub id: i64,
    /// By the clock of whoever wrote it.
    pub at: Timestamp,
    pub actor: Actor,
    /// What it is about.
    pub subject: Subject,
    pub event: Event,
}

/// What a listener of this process hears.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// It is in the events table.
    Recorded(Box<EventRecord>),
    /// Work on the subject has advanced. Nothing is recorded of it: it comes every second from every
    /// slot, the next one replaces it, and what matters in the end is in the shard's commit.
    Progress(Subject),
}

impl Change {
    /// What to look at again.
    #[must_use]
    pub const fn subject(&self) -> Subject {
        match self {
            Self::Recorded(record) => record.subject,
            Self::Progress(subject) => *subject,
        }
    }
}
