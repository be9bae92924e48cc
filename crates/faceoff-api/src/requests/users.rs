//! Requests about users, teams, tokens, invitations, terms and announcements.

use super::double_option::{deserialize_some, serialize_option};
use faceoff_types::{DivisionName, TeamId, TeamName, UserId, UserName};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// An API token to create.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewToken {
    /// What the token is used for, as a label in lists. 1 to 80 characters.
    pub name: String,
    /// When the token expires. Default: never.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires_at: Option<Timestamp>,
    /// The team that the token acts for. Given by an organiser or a member who creates a token for the team's API
    /// clients. Default: the token acts for the caller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
}

/// What happens to the credentials (tokens, invitations and webhooks) that were created with a revoked token.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = Made)]
pub enum CreatedCredentials {
    /// They stay.
    Keep,
    /// They end.
    End,
}

/// The extent of a revocation.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, IntoParams)]
#[serde(default, deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct RevocationQuery {
    /// What happens to all that was made with the token. Default: it ends, because others may have used the token;
    /// if the token is your own, it stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(inline)]
    pub made: Option<CreatedCredentials>,
}

/// The role that an invitation gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum InvitedRole {
    /// An organiser.
    Organiser,
    /// A member of `team`.
    Member,
    /// The first member of a new team.
    Founder,
    /// No new account: `person`, who has lost password and tokens, gets access again. Its name in JSON is `return`.
    #[serde(rename = "return")]
    RestoreAccess,
}

/// An invitation to create.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewInvitation {
    /// The role that the invitation gives.
    pub role: InvitedRole,
    /// The team of a `member`. Required from an organiser; a member invites to their own team.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// The user who gets access again. Required for `return`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<UserId>,
    /// A label for lists, e.g. the invited person's name. 1 to 80 characters.
    pub note: String,
    /// When the invitation expires, at most 90 days from now, for `return` 24 hours. Default: in seven days, for `return` in 24 hours.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires_at: Option<Timestamp>,
}

/// Accepts an invitation.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct JoinRequest {
    /// The code at the end of the invitation link.
    pub code: String,
    /// The new user's name, with which the user also signs in. 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
    /// Left out for the role `return`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<UserName>,
    /// At least 12 characters. Without one the user signs in by links and tokens only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub password: Option<String>,
    /// The team to create; for the role `founder`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<FoundedTeam>,
    /// The version of the terms (`GET /terms`) that the user accepts. Required if there are terms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_terms: Option<u32>,
}

/// A team to create or to register.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FoundedTeam {
    /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
    pub name: TeamName,
    /// The team's institution or company. 1 to 120 characters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub affiliation: Option<String>,
    /// The team's web page: an address that begins with http:// or https://
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<String>,
    /// One of the season's divisions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
}

/// Registers a team.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RegistrationRequest {
    /// The team to register.
    pub team: FoundedTeam,
    /// How the organisers can reach the team. Visible only to organisers. 1 to 120 characters.
    pub contact: String,
    /// The version of the terms (`GET /terms`) that the team accepts. Required if there are terms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_terms: Option<u32>,
}

/// Changes of a team. Fields that are left out stay as they are.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TeamChange {
    /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<TeamName>,
    /// The team's institution or company. 1 to 120 characters; null removes it.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_some",
        serialize_with = "serialize_option"
    )]
    #[schema(value_type = Option<String>)]
    pub affiliation: Option<Option<String>>,
    /// The team's web page: an address that begins with http:// or https://; null removes it.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_some",
        serialize_with = "serialize_option"
    )]
    #[schema(value_type = Option<String>)]
    pub link: Option<Option<String>>,
    /// One of the season's divisions; null removes the team from its division. For organisers only.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deserialize_some",
        serialize_with = "serialize_option"
    )]
    #[schema(value_type = Option<String>)]
    pub division: Option<Option<DivisionName>>,
    /// Whether the team is a reference agent of the organisers, which boards do not rank. For organisers only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline: Option<bool>,
    /// Whether the team declines friendly games that other teams ask for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub declines_friendly_games: Option<bool>,
}

/// Changes of the season. Fields that are left out stay as they are.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SeasonChange {
    /// Whether teams can register. An organiser approves each registration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub takes_registrations: Option<bool>,
    /// The divisions, in the order in which pages show them; an empty list removes all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub divisions: Option<Vec<DivisionName>>,
}

/// Signs a user in.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SignInRequest {
    /// The user's name.
    pub name: String,
    /// The user's password.
    pub password: String,
}

/// A user's new name.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct UserChange {
    /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
    pub name: UserName,
}

/// Sets the caller's password.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewPassword {
    /// The current password. Left out if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub old: Option<String>,
    /// The new password. At least 12 characters.
    pub password: String,
}

/// A new version of the terms.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTerms {
    /// Plain text. 1 to 20,000 characters.
    pub text: String,
}

/// An announcement to publish.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewAnnouncement {
    /// One line. 1 to 120 characters.
    pub title: String,
    /// Plain text. 1 to 5,000 characters.
    pub text: String,
}

/// A team's question to the organisers.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewQuestion {
    /// Plain text. 1 to 2,000 characters.
    pub text: String,
}

/// The organisers' answer to a question.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewAnswer {
    /// Plain text. 1 to 5,000 characters.
    pub text: String,
    /// Whether question and answer are public. The asking team is never published.
    pub public: bool,
}
