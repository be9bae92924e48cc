//! What is recorded of every change: who did what to what. The audit log, and what feeds read.

use faceoff_types::{
    AblationId, EvaluationId, RunId, ShardId, StageDay, StageId, StageName, StageRules,
    StageSettings, SubmissionId, Task, TeamId, TeamName, Zone,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};
use uuid::Uuid;

/// Who caused a change.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Actor {
    /// Whoever holds the organiser's token, or the server's configuration.
    Organiser,
    /// Whoever holds the team's token.
    Team(TeamId),
    /// The daily start.
    Schedule,
    /// A worker's slot, by the name under which it claims.
    Worker(String),
    /// What the server does by itself: tidying, derived data.
    Server,
}

impl fmt::Display for Actor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Organiser => f.write_str("organiser"),
            Self::Team(id) => write!(f, "team:{id}"),
            Self::Schedule => f.write_str("schedule"),
            Self::Worker(name) => write!(f, "worker:{name}"),
            Self::Server => f.write_str("server"),
        }
    }
}

/// Text that is none of an event's parts.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no actor or subject of an event")]
pub struct ParseEventError(String);

impl FromStr for Actor {
    type Err = ParseEventError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let unknown = || ParseEventError(s.to_owned());
        Ok(match s.split_once(':') {
            None if s == "organiser" => Self::Organiser,
            None if s == "schedule" => Self::Schedule,
            None if s == "server" => Self::Server,
            Some(("team", id)) => Self::Team(id.parse().map_err(|_| unknown())?),
            Some(("worker", name)) => Self::Worker(name.to_owned()),
            _ => return Err(unknown()),
        })
    }
}

/// What a change is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Subject {
    /// The season, of which a data folder has one.
    Season,
    /// A stage.
    Stage(StageId),
    /// A day of a stage.
    Day(StageDay),
    /// A day from before there were stages.
    DayOfNone(Date),
    /// A team.
    Team(TeamId),
    /// An upload and its smoke run.
    Submission(SubmissionId),
    /// An evaluation with its run and its scoring.
    Evaluation(EvaluationId),
    /// An ablation with its runs.
    Ablation(AblationId),
}

impl Subject {
    /// As the columns of the events table have it: kind and id.
    pub(crate) fn columns(self) -> (&'static str, String) {
        match self {
            Self::Season => ("season", String::new()),
            Self::Stage(id) => ("stage", id.to_string()),
            Self::Day(of) => ("day", of.to_string()),
            Self::DayOfNone(date) => ("day", date.to_string()),
            Self::Team(id) => ("team", id.to_string()),
            Self::Submission(id) => ("submission", id.to_string()),
            Self::Evaluation(id) => ("evaluation", id.to_string()),
            Self::Ablation(id) => ("ablation", id.to_string()),
        }
    }

    pub(crate) fn from_columns(kind: &str, id: &str) -> Result<Self, ParseEventError> {
        let unknown = || ParseEventError(format!("{kind} {id}"));
        Ok(match kind {
            "season" => Self::Season,
            "stage" => Self::Stage(id.parse().map_err(|_| unknown())?),
            "day" if id.contains('/') => Self::Day(id.parse().map_err(|_| unknown())?),
            "day" => Self::DayOfNone(id.parse().map_err(|_| unknown())?),
            "team" => Self::Team(id.parse().map_err(|_| unknown())?),
            "submission" => Self::Submission(id.parse().map_err(|_| unknown())?),
            "evaluation" => Self::Evaluation(id.parse().map_err(|_| unknown())?),
            "ablation" => Self::Ablation(id.parse().map_err(|_| unknown())?),
            _ => return Err(unknown()),
        })
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, id) = self.columns();
        match id.as_str() {
            "" => f.write_str(kind),
            id => write!(f, "{kind}:{id}"),
        }
    }
}

impl FromStr for Subject {
    type Err = ParseEventError;
    fn from_str(s: &str) -> Result<Self, Self::Err> {
        let (kind, id) = s.split_once(':').unwrap_or((s, ""));
        Self::from_columns(kind, id)
    }
}

/// What happened. The variants' names and fields are stored: new ones may be added, old ones stay.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Event {
    /// The organiser invited a team.
    TeamCreated {
        /// As it was at the invitation.
        name: TeamName,
    },
    /// The team has another token; the old one is void.
    TokenReplaced,
    /// A bundle came, and its smoke run is queued.
    SubmissionUploaded {
        /// Whose it is.
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
        /// What failed.
        reason: String,
    },
    /// It is what its team enters at the next cut: the newest that is valid, or the team's choice.
    SubmissionActivated,
    /// Its team has taken it back: it enters no further day.
    SubmissionWithdrawn,
    /// Its team calls it so.
    SubmissionLabelled {
        /// None any more, if it is null.
        label: Option<String>,
    },
    /// A submission is to play a day.
    EvaluationQueued {
        /// Whose it is.
        team: TeamId,
        /// What plays.
        submission: SubmissionId,
        /// Whose day; unknown of those from before there were stages.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stage: Option<StageId>,
        /// Its date.
        day: Date,
        /// What is played.
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
        /// In percent.
        score: f64,
        /// BLAKE3 of the dataset's archive.
        dataset_blake3: String,
    },
    /// Too many agent faults; no score.
    EvaluationAgentFailed,
    /// Our fault, given up.
    EvaluationPlatformFailed {
        /// What went wrong.
        reason: String,
    },
    /// Stopped by hand.
    EvaluationCancelled {
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
        /// Why.
        reason: String,
    },
    /// A submission is to be taken apart, profile by profile.
    AblationOrdered {
        /// What plays.
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
    /// Episodes were played and their outcomes stored.
    ShardCommitted {
        /// What they are a part of.
        run: RunId,
        /// The range's id.
        shard: ShardId,
        /// What was played.
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
        /// What failed.
        reason: String,
    },
    /// The cut of a day: its evaluations were queued, each with an event of its own.
    DayStarted {
        /// How many.
        evaluations: u32,
    },
    /// The day's seed is public: its last evaluation has ended (before there were cuts: its first
    /// dataset was handed out).
    DayReleased,
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
        /// The name.
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
    /// The stage has other rules from now on; before it opens, from its opening on.
    StageRulesChanged {
        /// From 1; before the opening, the one that there was.
        revision: u32,
        /// The new ones.
        rules: StageRules,
    },
    /// Its one day after the close has had its cut; the day has an event of its own.
    StageFinalStarted {
        /// Its date.
        day: Date,
    },
    /// Its result is signed off: nothing of it changes any more.
    StageFinalised,
    /// Nothing of the queue is begun from now on.
    QueuePaused {
        /// As everybody may read it.
        reason: String,
    },
    /// The queue goes on.
    QueueResumed,
    /// The season has another name.
    SeasonNamed {
        /// The new one.
        name: String,
    },
    /// The secret is public and nothing more is evaluated.
    SeasonClosed,
}

impl Event {
    /// Is there an event of this name?
    ///
    /// # Errors
    /// If not, with the names that there are.
    pub fn check_kind(name: &str) -> Result<(), String> {
        let named = serde_json::json!({ "kind": name });
        match serde_json::from_value::<Self>(named) {
            Err(error) if error.to_string().starts_with("unknown variant") => {
                Err(error.to_string())
            }
            // There is, whether or not it has fields that are wanting here.
            _ => Ok(()),
        }
    }
}

/// An event as it is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct EventRecord {
    /// Rises with every event of the data folder, in the order of the commits.
    pub id: i64,
    /// By the clock of whoever wrote it.
    pub at: Timestamp,
    /// Who caused it.
    pub actor: Actor,
    /// What it is about.
    pub subject: Subject,
    /// What happened.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn actors_and_subjects_read_back_as_they_are_written() {
        let actors = [
            Actor::Organiser,
            Actor::Team(TeamId::new()),
            Actor::Schedule,
            Actor::Worker("host:1/slot-0".into()),
            Actor::Server,
        ];
        for actor in actors {
            assert_eq!(actor.to_string().parse(), Ok(actor));
        }
        assert!("team:none".parse::<Actor>().is_err());
        let subjects = [
            Subject::Season,
            Subject::Stage(StageId::new()),
            Subject::Day(StageDay {
                stage: StageId::new(),
                date: jiff::civil::date(2026, 3, 1),
            }),
            Subject::DayOfNone(jiff::civil::date(2026, 3, 1)),
            Subject::Team(TeamId::new()),
            Subject::Submission(SubmissionId::new()),
            Subject::Evaluation(EvaluationId::new()),
            Subject::Ablation(AblationId::new()),
        ];
        for subject in subjects {
            let (kind, id) = subject.columns();
            assert_eq!(Subject::from_columns(kind, &id), Ok(subject));
            assert_eq!(subject.to_string().parse(), Ok(subject));
        }
        assert!(Subject::from_columns("team", "none").is_err());
    }

    #[test]
    fn names_of_events_are_known_with_and_without_fields() {
        for kind in ["season_closed", "team_created", "day_started"] {
            assert_eq!(Event::check_kind(kind), Ok(()));
        }
        let unknown = Event::check_kind("day_start").unwrap_err();
        assert!(unknown.contains("day_started"), "{unknown}");
    }
}
