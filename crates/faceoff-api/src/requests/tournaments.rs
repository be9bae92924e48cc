//! About tournaments and their games.

use super::{
    field_by_field::FieldByField,
    left_out::{given, given_or_null},
};
use faceoff_types::{
    LeftAs, RoundNumber, SubmissionId, TeamName, TournamentRules, TournamentSettings,
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::{IntoParams, ToSchema};

// The macro reads no parameters of a type that it is told.
type RulesByField = FieldByField<TournamentRules>;
type SettingsByField = FieldByField<TournamentSettings>;

/// A tournament to open.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTournament {
    /// 1 to 40 letters, digits, spaces and . _ -
    pub name: String,
    /// Id or name of the stage on whose board its teams stand; left out, the stage that is open, or the nearest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
    /// What results depend on; what of it is left out is as the challenge had it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<RulesByField>)]
    pub rules: Option<Map<String, Value>>,
    /// What they do not depend on; likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<SettingsByField>)]
    pub settings: Option<Map<String, Value>>,
    /// Its teams; left out, those that the stage's board has as deployable or improvable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub teams: Option<Vec<TeamName>>,
}

/// What of a tournament is to be another; what is left out stays as it is.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TournamentChange {
    /// 1 to 40 letters, digits, spaces and . _ -
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Field by field, before the first round; null takes one away that need not be there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<RulesByField>)]
    pub rules: Option<Map<String, Value>>,
    /// Field by field.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<SettingsByField>)]
    pub settings: Option<Map<String, Value>>,
    /// A valid submission, of any team, against which teams may test theirs; null: none.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<SubmissionId>)]
    pub baseline: Option<Option<SubmissionId>>,
}

/// Teams to enter.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewEntrants {
    /// Their names; at least one.
    pub teams: Vec<TeamName>,
}

/// A team that leaves for good.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewDeparture {
    /// Its name.
    pub team: TeamName,
    /// How.
    pub r#as: LeftAs,
    /// The first round whose games with it do not count, of a disqualified team; left out, the one that is under way, or
    /// the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<u32>, minimum = 1, maximum = 100)]
    pub from_round: Option<RoundNumber>,
    /// Everybody may read it; 1 to 500 characters.
    pub reason: String,
    /// The team's name. Without it nothing is done, and the answer says what would be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// Games against the baseline.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct NewTestGames {
    /// Whose, if an organiser asks; left out, everybody's who is in the tournament. A team asks for its own alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub teams: Option<Vec<TeamName>>,
}

/// A game that does not count.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewFriendlyGame {
    /// The other team's name.
    pub opponent: TeamName,
}

/// How often a schedule is to be played again.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewReplays {
    /// So many times more.
    #[schema(minimum = 1, maximum = 1000)]
    pub times: u32,
}

/// Which of a tournament's games.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, IntoParams)]
#[serde(default, deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct GamesQuery {
    /// Of one round alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(value_type = Option<u32>, minimum = 1, maximum = 100)]
    pub round: Option<RoundNumber>,
}
