//! About people, their teams and their tokens.

use super::left_out::{given, given_or_null};
use faceoff_types::{DivisionName, PersonId, PersonName, TeamId, TeamName};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A token to make.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewToken {
    /// What it is for: 1 to 80 characters.
    pub name: String,
    /// From then on it is worth nothing; left out, it has no end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires_at: Option<Timestamp>,
    /// The team whose programs it is for, if an organiser or a member makes it for them; left out, it speaks for who
    /// makes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
}

/// What an invitation makes of whoever follows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum InvitedRole {
    /// One of the organisers.
    Organiser,
    /// A member of `team`.
    Member,
    /// The first member of a team that they name.
    Founder,
    /// `person`, who has lost password and tokens.
    Return,
}

/// An invitation to make.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewInvitation {
    /// What it makes of whoever follows it.
    pub role: InvitedRole,
    /// Of a `member`; a member who invites may leave it out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// Who is to `return`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<PersonId>,
    /// For whom it is: 1 to 80 characters.
    pub note: String,
    /// From then on it is worth nothing; left out, in seven days.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires_at: Option<Timestamp>,
}

/// What whoever follows an invitation says.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Join {
    /// The code at the end of the link.
    pub code: String,
    /// By which they are known and sign in: 1 to 40 letters, digits, spaces and . _ -; whoever comes back leaves it out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<PersonName>,
    /// 12 or more characters; left out, they sign in by links and tokens alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub password: Option<String>,
    /// The founder's team.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<FoundedTeam>,
    /// The version of the terms (`GET /terms`) that they accept, if there are terms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_terms: Option<u32>,
}

/// A team as its founder describes it.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FoundedTeam {
    /// 1 to 40 letters, digits, spaces and . _ -
    pub name: TeamName,
    /// Where it is from: 1 to 120 characters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub affiliation: Option<String>,
    /// Its page: an address that begins with http:// or https://
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<String>,
    /// One of the season's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
}

/// A team that wants to take part.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Register {
    /// The team.
    pub team: FoundedTeam,
    /// How the organisers reach it: 1 to 120 characters that nobody else sees.
    pub contact: String,
    /// The version of the terms (`GET /terms`) that it accepts, if there are terms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_terms: Option<u32>,
}

/// What of a team is to be another; what is left out stays as it is.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TeamChange {
    /// 1 to 40 letters, digits, spaces and . _ -
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<TeamName>,
    /// Where it is from: 1 to 120 characters; null: it does not say.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<String>)]
    pub affiliation: Option<Option<String>>,
    /// Its page: an address that begins with http:// or https://; null: none.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<String>)]
    pub link: Option<Option<String>>,
    /// One of the season's; null: none. Only organisers change it.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "given",
        serialize_with = "given_or_null"
    )]
    #[schema(value_type = Option<String>)]
    pub division: Option<Option<DivisionName>>,
    /// Is it a reference agent of the organisers, which no board ranks? Only organisers change it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline: Option<bool>,
    /// Does it play no friendly games that other teams ask for?
    #[serde(skip_serializing_if = "Option::is_none")]
    pub declines_friendly_games: Option<bool>,
}

/// What of the season is to be another; what is left out stays as it is.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SeasonChange {
    /// May anybody register a team? An organiser approves each.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub takes_registrations: Option<bool>,
    /// That teams can be in, in the order in which they are shown; empty: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub divisions: Option<Vec<DivisionName>>,
}

/// Who wants to sign in.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SignIn {
    /// The person's.
    pub name: String,
    /// Theirs.
    pub password: String,
}

/// A password to set.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewPassword {
    /// The one that there is; left out, there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub old: Option<String>,
    /// 12 or more characters.
    pub password: String,
}

/// Terms to publish.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTerms {
    /// Plain text, 1 to 20,000 characters.
    pub text: String,
}

/// What everybody is to be told.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewAnnouncement {
    /// One line of 1 to 120 characters.
    pub title: String,
    /// Plain text, 1 to 5,000 characters.
    pub text: String,
}

/// What a team asks the organisers.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewQuestion {
    /// Plain text, 1 to 2,000 characters.
    pub text: String,
}

/// What the organisers answer.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewAnswer {
    /// Plain text, 1 to 5,000 characters.
    pub text: String,
    /// May everybody read question and answer? Who asked stays with the organisers.
    pub public: bool,
}
