//! Notices of events, and their visibility. A notice names an event of the season's log, its *subject* (what the event is
//! about, such as an evaluation) and the subject's *context* (such as its team and stage). Recipients get neither scores
//! nor free texts: the notice says only what to reload.

use crate::stage_visibility::StageVisibility;
use faceoff_store::{Event, EventRecord, Subject, SubjectContext};
use faceoff_types::TeamId;
use jiff::Timestamp;
use serde_json::{Map, Value, json};

/// Recipients for which the visibility of a notice is checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Audience {
    Public,
    Team(TeamId),
    Organiser,
}

/// An event of the log, with everything on which its visibility depends.
#[derive(Debug, Clone, PartialEq)]
pub struct Notice {
    /// Id of the event; ids are ascending.
    pub id: i64,
    pub at: Timestamp,
    /// Kind of the event, such as `day_released`.
    pub kind: String,
    pub event: Event,
    /// The resource that the event changes.
    pub subject: Subject,
    /// The teams, stage and day that the subject belongs to.
    pub context: SubjectContext,
}

impl Notice {
    #[must_use]
    pub fn new(record: EventRecord, context: SubjectContext) -> Self {
        let fields = serde_json::to_value(&record.event).unwrap_or_default();
        Self {
            id: record.id,
            at: record.at,
            kind: fields["kind"].as_str().unwrap_or_default().to_owned(),
            event: record.event,
            subject: record.subject,
            context,
        }
    }

    /// Whether an audience may see the notice.
    #[must_use]
    pub fn is_visible_to(&self, audience: Audience, stage_visibility: &StageVisibility) -> bool {
        match audience {
            Audience::Organiser => true,
            Audience::Team(team) => self.is_own(team) || self.is_public(stage_visibility),
            Audience::Public => self.is_public(stage_visibility),
        }
    }

    /// Whether the notice concerns this team, so that the team sees it even if it is not public.
    fn is_own(&self, own_team: TeamId) -> bool {
        match self.context {
            // Platform faults are visible to organisers only.
            _ if matches!(self.event, Event::JobFailed { .. }) => false,
            SubjectContext::Team(team)
            | SubjectContext::Submission { team, .. }
            | SubjectContext::Ablation { team, .. }
            | SubjectContext::Evaluation { team, .. } => team == own_team,
            SubjectContext::Game { teams, .. } => teams.contains(&own_team),
            SubjectContext::Question { team } => team == Some(own_team),
            // A user's other events, such as sign-ins and new tokens, are private to the user.
            SubjectContext::User { team } => {
                let is_membership = matches!(
                    self.event,
                    Event::UserJoined { .. } | Event::UserRenamed { .. } | Event::UserLeft { .. }
                );
                is_membership && team == Some(own_team)
            }
            SubjectContext::Season
            | SubjectContext::Stage { .. }
            | SubjectContext::Tournament(_)
            | SubjectContext::Organisers => false,
        }
    }

    /// Whether the notice is public. Results of blind stages and those after a freeze of the board are hidden. Before a
    /// day's results are released, only the events that boards show at once are public.
    fn is_public(&self, stage_visibility: &StageVisibility) -> bool {
        match self.context {
            SubjectContext::Evaluation {
                stage,
                finished_at,
                is_released,
                ..
            } => {
                let is_shown_at_once = matches!(
                    self.event,
                    Event::EvaluationFinished { .. } | Event::EvaluationVoided { .. }
                );
                self.event.is_public()
                    && (is_released || is_shown_at_once)
                    && stage_visibility.is_result_visible(stage, finished_at)
            }
            // The page of a public game shows everything but platform faults.
            SubjectContext::Game { is_public, .. } => {
                is_public && !matches!(self.event, Event::JobFailed { .. })
            }
            SubjectContext::Question { .. } => {
                matches!(self.event, Event::Answered { public: true })
            }
            SubjectContext::Season
            | SubjectContext::Stage { .. }
            | SubjectContext::Tournament(_)
            | SubjectContext::Team(_) => self.event.is_public(),
            SubjectContext::Submission { .. }
            | SubjectContext::Ablation { .. }
            | SubjectContext::User { .. }
            | SubjectContext::Organisers => false,
        }
    }

    /// Whether the notice is about this subject or a part of it. An evaluation, for example, is a part of its stage and of its day.
    pub(crate) fn is_about(&self, subject: Subject) -> bool {
        let is_part = match (subject, self.context) {
            (Subject::Team(team), _) => self.teams().contains(&team),
            (Subject::Stage(id), SubjectContext::Stage { stage, .. })
            | (Subject::Stage(id), SubjectContext::Evaluation { stage, .. }) => id == stage,
            (Subject::Day(stage_day), SubjectContext::Evaluation { stage, day, .. }) => {
                (stage_day.stage, stage_day.date) == (stage, day)
            }
            (Subject::Submission(id), SubjectContext::Evaluation { submission, .. })
            | (Subject::Submission(id), SubjectContext::Ablation { submission, .. }) => {
                id == submission
            }
            (Subject::Tournament(id), SubjectContext::Game { tournament, .. }) => id == tournament,
            _ => false,
        };
        is_part || subject == self.subject
    }

    /// Teams that the notice is about.
    fn teams(&self) -> Vec<TeamId> {
        match (&self.event, &self.context) {
            (Event::TeamsEntered { teams } | Event::TournamentOpened { teams, .. }, _) => {
                teams.clone()
            }
            (Event::EntrantRemoved { team, .. } | Event::TeamLeftTournament { team, .. }, _)
            | (Event::RegistrationApproved { team }, _)
            | (_, SubjectContext::Team(team))
            | (_, SubjectContext::Submission { team, .. })
            | (_, SubjectContext::Ablation { team, .. })
            | (_, SubjectContext::Evaluation { team, .. }) => vec![*team],
            (_, SubjectContext::Game { teams, .. }) if teams[0] == teams[1] => vec![teams[0]],
            (_, SubjectContext::Game { teams, .. }) => teams.to_vec(),
            (_, SubjectContext::User { team }) => team.iter().copied().collect(),
            // The author of a question is private.
            _ => Vec::new(),
        }
    }

    /// The notice as recipients get it: the ids of what has changed, without the event's content.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut fields = Map::new();
        let mut add_field = |name: &str, value: Value| {
            fields.insert(name.to_owned(), value);
        };
        add_field("id", json!(self.id));
        add_field("kind", json!(self.kind));
        add_field("at", json!(self.at));
        add_field("subject", json!(self.subject.to_string()));
        let teams = self.teams();
        if !teams.is_empty() {
            add_field("teams", json!(teams));
        }
        match self.context {
            SubjectContext::Stage { stage, day } => {
                add_field("stage", json!(stage));
                if let Some(day) = day {
                    add_field("day", json!(day));
                }
            }
            SubjectContext::Evaluation {
                stage,
                day,
                submission,
                ..
            } => {
                add_field("stage", json!(stage));
                add_field("day", json!(day));
                add_field("submission", json!(submission));
            }
            SubjectContext::Submission { submission, .. }
            | SubjectContext::Ablation { submission, .. } => {
                add_field("submission", json!(submission));
            }
            SubjectContext::Tournament(tournament) | SubjectContext::Game { tournament, .. } => {
                add_field("tournament", json!(tournament));
            }
            SubjectContext::Season
            | SubjectContext::Team(_)
            | SubjectContext::User { .. }
            | SubjectContext::Question { .. }
            | SubjectContext::Organisers => {}
        }
        Value::Object(fields)
    }
}
