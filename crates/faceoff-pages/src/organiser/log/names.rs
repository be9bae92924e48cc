//! Names of what the log is about, in place of its identifiers.

use faceoff_api::views::event::EventView;
use faceoff_service::{app::AppState, problem::Problem, views::event};
use faceoff_store::{Subject, SubjectContext};
use std::collections::BTreeMap;
use uuid::Uuid;

/// Names by identifiers as the log writes them, such as `team:ID`.
pub(super) struct Names(BTreeMap<String, String>);

impl Names {
    /// The names for these events.
    pub(super) async fn load(app: &AppState, events: &[EventView]) -> Result<Self, Problem> {
        let mut names = Self(event::actor_names(app).await?);
        for stage in app.store.stages().await? {
            names
                .0
                .insert(format!("stage:{}", stage.id), stage.name.to_string());
        }
        for tournament in app.store.tournaments().await? {
            let key = format!("tournament:{}", tournament.id);
            names
                .0
                .insert(key, format!("the tournament {}", tournament.name));
        }
        for registration in app.store.registrations().await? {
            let key = format!("registration:{}", registration.id);
            let name = format!("the registration of {}", registration.team_name);
            names.0.insert(key, name);
        }
        for event in events {
            if names.0.contains_key(&event.subject) {
                continue;
            }
            let Ok(subject) = event.subject.parse::<Subject>() else {
                continue;
            };
            let needs_context = matches!(
                subject,
                Subject::Submission(_)
                    | Subject::Evaluation(_)
                    | Subject::Ablation(_)
                    | Subject::Game(_)
                    | Subject::Question(_)
            );
            if !needs_context {
                continue;
            }
            let context = app.store.subject_context(subject).await?;
            if let Some(name) = names.of_context(subject, context) {
                names.0.insert(event.subject.clone(), name);
            }
        }
        Ok(names)
    }

    /// The name of a subject that is named after its team or teams, such as “Alpha’s evaluation of 2026-03-01”. `None` if the teams are
    /// not known.
    fn of_context(&self, subject: Subject, context: SubjectContext) -> Option<String> {
        let team = |id: faceoff_types::TeamId| self.team(&id.to_string());
        Some(match (subject, context) {
            (Subject::Ablation(_), SubjectContext::Ablation { team: id, .. }) => {
                format!("{}’s ablation", team(id)?)
            }
            (_, SubjectContext::Submission { team: id, .. }) => {
                format!("{}’s submission", team(id)?)
            }
            (_, SubjectContext::Evaluation { team: id, day, .. }) => {
                format!("{}’s evaluation of {day}", team(id)?)
            }
            (_, SubjectContext::Game { teams: [a, b], .. }) => {
                format!("the game {} – {}", team(a)?, team(b)?)
            }
            (_, SubjectContext::Question { team: Some(id) }) => {
                format!("{}’s question", team(id)?)
            }
            _ => return None,
        })
    }

    /// The name of the team with this id.
    pub(super) fn team(&self, id: &str) -> Option<&str> {
        self.0.get(&format!("team:{id}")).map(String::as_str)
    }

    /// The name of the stage with this id.
    pub(super) fn stage(&self, id: &str) -> Option<&str> {
        self.0.get(&format!("stage:{id}")).map(String::as_str)
    }

    /// The author of an event, as the subject of a sentence.
    pub(super) fn actor(&self, event: &EventView) -> String {
        // A person who joins or signs in is a visitor until then.
        let is_joining = event.actor == "visitor" && event.subject.starts_with("person:");
        let author = match is_joining {
            true => &event.subject,
            false => &event.actor,
        };
        let name = self.0.get(author).or(event.actor_name.as_ref());
        match (event.actor.split_once(':'), name) {
            (Some(("team", _)), Some(name)) => format!("The team {name}"),
            (_, Some(name)) => name.clone(),
            (Some(("worker", slot)), None) => match slot.split_once('/') {
                // The server's own slots are named after its process.
                Some((process, _)) if process.parse::<Uuid>().is_ok() => "The server".to_owned(),
                Some((worker, _)) => format!("The worker {worker}"),
                None => format!("The worker {slot}"),
            },
            (Some(("person", _)), None) => "A former user".to_owned(),
            (Some(_), None) => "A team".to_owned(),
            (None, None) => match event.actor.as_str() {
                // The operator's token, which belongs to no account.
                "organiser" => "The operator".to_owned(),
                "visitor" => "A visitor".to_owned(),
                other => format!("The {other}"),
            },
        }
    }

    /// What was changed, as the object of a sentence.
    pub(super) fn subject(&self, subject: &str) -> String {
        if let Some(name) = self.0.get(subject) {
            return name.clone();
        }
        match subject.split_once(':') {
            None => format!("the {subject}"),
            Some(("day", day)) => match day.split_once('/') {
                Some((stage, date)) => {
                    let stage = self.stage(stage).unwrap_or("a stage");
                    format!("the evaluation day {date} of {stage}")
                }
                None => format!("the evaluation day {day}"),
            },
            Some(("person", _)) => "a former user".to_owned(),
            Some((kind @ ("evaluation" | "ablation" | "announcement"), _)) => format!("an {kind}"),
            Some((kind, _)) => format!("a {kind}"),
        }
    }

    /// Identifiers and names of everyone who has an account, and of all teams, by name: the authors to choose from.
    pub(super) fn authors(&self) -> Vec<(String, String)> {
        let is_author = |key: &str| key.starts_with("person:") || key.starts_with("team:");
        let mut authors: Vec<(String, String)> = self
            .0
            .iter()
            .filter(|(key, _)| is_author(key))
            .map(|(key, name)| match key.starts_with("team:") {
                true => (key.clone(), format!("{name} (team)")),
                false => (key.clone(), name.clone()),
            })
            .collect();
        authors.sort_by_key(|(_, name)| name.to_lowercase());
        authors
    }
}

#[cfg(test)]
impl<const N: usize> From<[(&str, &str); N]> for Names {
    fn from(names: [(&str, &str); N]) -> Self {
        let owned = |(key, name): (&str, &str)| (key.to_owned(), name.to_owned());
        Self(names.into_iter().map(owned).collect())
    }
}
