//! Requests about tournaments and their games.

use super::{
    double_option::{deserialize_some, serialize_option},
    merge_patch::MergePatch,
};
use faceoff_types::{
    DepartureKind, RoundNumber, SubmissionId, TeamName, TournamentRules, TournamentSettings,
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::{IntoParams, ToSchema};

// These aliases are needed because the macro `ToSchema` does not parse type arguments in `value_type`.
type RulesPatch = MergePatch<TournamentRules>;
type SettingsPatch = MergePatch<TournamentSettings>;

/// A tournament to create.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTournament {
    /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
    pub name: String,
    /// Id or name of the stage whose board qualifies the teams. Default: the open stage, or the one nearest in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
    /// What results depend on. Fields that are left out have the values of the original challenge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<RulesPatch>)]
    pub rules: Option<Map<String, Value>>,
    /// What results do not depend on. Fields that are left out have their default values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<SettingsPatch>)]
    pub settings: Option<Map<String, Value>>,
    /// The entrants. Default: the teams that the stage's board shows as deployable or improvable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub teams: Option<Vec<TeamName>>,
}

/// Changes of a tournament. Fields that are left out stay as they are.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TournamentChange {
    /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// A JSON merge patch (RFC 7396) of the rules, before the first round only. null restores the default of an optional field.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<RulesPatch>)]
    pub rules: Option<Map<String, Value>>,
    /// A JSON merge patch of the settings.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<SettingsPatch>)]
    pub settings: Option<Map<String, Value>>,
    /// A valid submission of any team that serves as the opponent of test games; null: none.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_some",
        serialize_with = "serialize_option"
    )]
    #[schema(value_type = Option<SubmissionId>)]
    pub baseline: Option<Option<SubmissionId>>,
}

/// Teams to enter into a tournament.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewEntrants {
    /// Names of the teams; at least one.
    pub teams: Vec<TeamName>,
}

/// Withdraws or disqualifies a team from a tournament, for good.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewDeparture {
    /// The team's name.
    pub team: TeamName,
    /// Whether the team withdraws or is disqualified.
    #[serde(rename = "as")]
    pub kind: DepartureKind,
    /// For a disqualified team: the first round whose games against it do not count. Default: the running round, or the
    /// next one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<u32>, minimum = 1, maximum = 100)]
    pub from_round: Option<RoundNumber>,
    /// Public. 1 to 500 characters.
    pub reason: String,
    /// The team's name. Without it the request changes nothing and the response describes the effects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirm: Option<String>,
}

/// Test games against the tournament's baseline.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct NewTestGames {
    /// Names of the teams that get a test game, if an organiser requests them. Default: all entrants. A team can request a
    /// test game only for itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub teams: Option<Vec<TeamName>>,
}

/// A friendly game, which does not count.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewFriendlyGame {
    /// The opponent's name.
    pub opponent: TeamName,
}

/// Replays of a tournament's schedule with other seeds. They do not count; they show how certain the champion is.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewReplays)]
pub struct NewScheduleReplays {
    /// Number of further replays.
    #[schema(minimum = 1, maximum = 1000)]
    pub times: u32,
}

/// Filter of a tournament's games.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, IntoParams)]
#[serde(default, deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct GamesQuery {
    /// Return only games of this round.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(value_type = Option<u32>, minimum = 1, maximum = 100)]
    pub round: Option<RoundNumber>,
}
