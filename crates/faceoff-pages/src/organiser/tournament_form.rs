//! A form with the most important rules of a new tournament, and its conversion into a request of the API.

use super::form_lines;
use faceoff_api::requests::NewTournament;
use faceoff_service::{app::App, problem::Problem, views::stage};
use faceoff_types::{Publication, TeamName, TournamentFormat, TournamentSettings};
use serde::Deserialize;
use serde_json::{Map, Value, json};

/// What was typed.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct TournamentForm {
    pub(super) name: String,
    /// Name of the stage whose board qualifies the teams.
    pub(super) stage: String,
    /// One name per line; empty: the teams that qualify.
    pub(super) teams: String,
    pub(super) format: String,
    /// Number of rounds; of round robin and Swiss only.
    pub(super) rounds: String,
    /// Number of groups, and of the teams of each group that advance to the final; of groups only.
    pub(super) groups: String,
    pub(super) advance: String,
    /// Checkbox: not sent if it is not ticked.
    pub(super) mirrored: String,
    pub(super) publishes: String,
}

/// Names of formats with their titles.
const FORMATS: [(&str, &str); 3] = [
    (
        "round_robin",
        "Round robin: every team plays every other team",
    ),
    ("groups", "Groups, then a final round of the best teams"),
    ("swiss", "Swiss: opponents of about the same rank"),
];

impl TournamentForm {
    /// The defaults: the format of the original challenge, with the teams of the current stage's board.
    pub(super) async fn defaults(app: &App) -> Result<Self, Problem> {
        let rules = app.config.competition().tournament_rules();
        let (format, rounds) = match rules.format {
            TournamentFormat::RoundRobin { rounds } => ("round_robin", Some(rounds)),
            TournamentFormat::Swiss { rounds } => ("swiss", Some(rounds)),
            TournamentFormat::Groups { .. } => ("groups", None),
        };
        Ok(Self {
            stage: stage::current(app).await?.name.to_string(),
            format: format.to_owned(),
            rounds: rounds.map_or_else(|| "2".to_owned(), |rounds| rounds.to_string()),
            groups: "2".to_owned(),
            advance: "1".to_owned(),
            mirrored: match rules.mirrored {
                true => "on".to_owned(),
                false => String::new(),
            },
            publishes: TournamentSettings::default().publishes.as_str().to_owned(),
            ..Self::default()
        })
    }

    pub(super) const fn formats(&self) -> &'static [(&'static str, &'static str)] {
        &FORMATS
    }

    /// When recordings become public: values and titles.
    pub(super) fn publications(&self) -> [(&'static str, &'static str); 3] {
        Publication::ALL.map(|publication| {
            let title = match publication {
                Publication::Never => "never",
                Publication::AtClose => "when the tournament is closed",
                Publication::AtRelease => "after each round",
            };
            (publication.as_str(), title)
        })
    }

    /// The request that opens the tournament.
    pub(super) fn request(&self) -> Result<NewTournament, Problem> {
        let number = |field: &str, text: &str| {
            let parsed = text.trim().parse::<u32>();
            parsed.map_err(|_| {
                Problem::invalid(field, format_args!("expected a number, got {text:?}"))
            })
        };
        let format = match self.format.as_str() {
            "groups" => json!({
                "kind": "groups",
                "groups": number("groups", &self.groups)?,
                "advance": number("advance", &self.advance)?,
            }),
            kind => json!({ "kind": kind, "rounds": number("rounds", &self.rounds)? }),
        };
        let teams: Vec<TeamName> = form_lines::parse("teams", &self.teams)?;
        let object = |fields: &[(&str, Value)]| {
            let owned = |(name, value): &(&str, Value)| ((*name).to_owned(), value.clone());
            Some(fields.iter().map(owned).collect::<Map<_, _>>())
        };
        Ok(NewTournament {
            name: self.name.trim().to_owned(),
            stage: Some(self.stage.clone()).filter(|stage| !stage.is_empty()),
            rules: object(&[
                ("format", format),
                ("mirrored", json!(!self.mirrored.is_empty())),
            ]),
            settings: object(&[("publishes", json!(self.publishes))]),
            teams: Some(teams).filter(|teams| !teams.is_empty()),
        })
    }
}
