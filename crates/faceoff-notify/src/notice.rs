//! A change, as it is told, and who is told of it.

use crate::stages_told::StagesTold;
use faceoff_store::{Concern, Event, EventRecord, Subject};
use faceoff_types::TeamId;
use jiff::Timestamp;
use serde_json::{Map, Value, json};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reader {
    Anybody,
    Team(TeamId),
    Organiser,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Notice {
    /// Of the event: they rise.
    pub id: i64,
    pub at: Timestamp,
    /// What happened, by name.
    pub kind: String,
    pub event: Event,
    pub subject: Subject,
    /// With what belongs to it.
    pub concern: Concern,
}

impl Notice {
    /// Of an event and whom it concerns.
    #[must_use]
    pub fn new(record: EventRecord, concern: Concern) -> Self {
        let fields = serde_json::to_value(&record.event).unwrap_or_default();
        Self {
            id: record.id,
            at: record.at,
            kind: fields["kind"].as_str().unwrap_or_default().to_owned(),
            event: record.event,
            subject: record.subject,
            concern,
        }
    }

    /// Is it told to somebody?
    #[must_use]
    pub fn is_told_to(&self, reader: Reader, stages: &StagesTold) -> bool {
        match reader {
            Reader::Organiser => true,
            Reader::Team(team) => self.is_own(team) || self.is_public(stages),
            Reader::Anybody => self.is_public(stages),
        }
    }

    /// Is it a team's own business?
    fn is_own(&self, reader: TeamId) -> bool {
        match self.concern {
            // That we broke something, and play it again, is ours.
            _ if matches!(self.event, Event::UnitGivenBack { .. }) => false,
            Concern::Team(team)
            | Concern::Submission { team, .. }
            | Concern::Ablation { team, .. }
            | Concern::Evaluation { team, .. } => team == reader,
            Concern::Game { teams, .. } => teams.contains(&reader),
            Concern::Question { team } => team == Some(reader),
            // When they sign in, and with which keys, is their own.
            Concern::Person { team } => {
                let is_told = matches!(
                    self.event,
                    Event::PersonJoined { .. } | Event::PersonLeft { .. }
                );
                is_told && team == Some(reader)
            }
            Concern::Season
            | Concern::Stage { .. }
            | Concern::Tournament(_)
            | Concern::Organisers => false,
        }
    }

    /// May everybody know? Of a stage that is blind, or whose boards stand still, nothing that tells of a result; of a
    /// day that is not out only what boards show at once.
    fn is_public(&self, stages: &StagesTold) -> bool {
        match self.concern {
            Concern::Evaluation {
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
                    && stages.shows(stage, finished_at)
            }
            // All that is told of such a game is on its page.
            Concern::Game { is_public, .. } => {
                is_public && !matches!(self.event, Event::UnitGivenBack { .. })
            }
            Concern::Question { .. } => matches!(self.event, Event::Answered { public: true }),
            Concern::Season | Concern::Stage { .. } | Concern::Tournament(_) | Concern::Team(_) => {
                self.event.is_public()
            }
            Concern::Submission { .. }
            | Concern::Ablation { .. }
            | Concern::Person { .. }
            | Concern::Organisers => false,
        }
    }

    /// Is it about this, or about something of it?
    pub(crate) fn is_about(&self, subject: Subject) -> bool {
        let is_of_concern = match (subject, self.concern) {
            (Subject::Team(team), _) => self.teams().contains(&team),
            (Subject::Stage(of), Concern::Stage { stage, .. })
            | (Subject::Stage(of), Concern::Evaluation { stage, .. }) => of == stage,
            (Subject::Day(of), Concern::Evaluation { stage, day, .. }) => {
                (of.stage, of.date) == (stage, day)
            }
            (Subject::Submission(of), Concern::Evaluation { submission, .. })
            | (Subject::Submission(of), Concern::Ablation { submission, .. }) => of == submission,
            (Subject::Tournament(of), Concern::Game { tournament, .. }) => of == tournament,
            _ => false,
        };
        is_of_concern || subject == self.subject
    }

    /// The teams that it is about.
    fn teams(&self) -> Vec<TeamId> {
        match (&self.event, &self.concern) {
            (Event::TeamsEntered { teams } | Event::TournamentOpened { teams, .. }, _) => {
                teams.clone()
            }
            (Event::TeamOut { team, .. } | Event::TeamLeftTournament { team, .. }, _)
            | (Event::RegistrationApproved { team }, _)
            | (_, Concern::Team(team))
            | (_, Concern::Submission { team, .. })
            | (_, Concern::Ablation { team, .. })
            | (_, Concern::Evaluation { team, .. }) => vec![*team],
            (_, Concern::Game { teams, .. }) if teams[0] == teams[1] => vec![teams[0]],
            (_, Concern::Game { teams, .. }) => teams.to_vec(),
            (_, Concern::Person { team }) => team.iter().copied().collect(),
            // Who asks is told to nobody.
            _ => Vec::new(),
        }
    }

    /// As everybody who is told reads it: what to ask for again, and nothing of what it says.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut fields = Map::new();
        let mut put = |name: &str, value: Value| {
            fields.insert(name.to_owned(), value);
        };
        put("id", json!(self.id));
        put("kind", json!(self.kind));
        put("at", json!(self.at));
        put("subject", json!(self.subject.to_string()));
        let teams = self.teams();
        if !teams.is_empty() {
            put("teams", json!(teams));
        }
        match self.concern {
            Concern::Stage { stage, day } => {
                put("stage", json!(stage));
                if let Some(day) = day {
                    put("day", json!(day));
                }
            }
            Concern::Evaluation {
                stage,
                day,
                submission,
                ..
            } => {
                put("stage", json!(stage));
                put("day", json!(day));
                put("submission", json!(submission));
            }
            Concern::Submission { submission, .. } | Concern::Ablation { submission, .. } => {
                put("submission", json!(submission));
            }
            Concern::Tournament(tournament) | Concern::Game { tournament, .. } => {
                put("tournament", json!(tournament));
            }
            Concern::Season
            | Concern::Team(_)
            | Concern::Person { .. }
            | Concern::Question { .. }
            | Concern::Organisers => {}
        }
        Value::Object(fields)
    }
}
