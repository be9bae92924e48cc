//! Creation of a user's account: the user accepts an invitation by its code, and founds or joins a team, or becomes an
//! organiser.

use crate::{app::AppState, boxed_future, network::Network, problem::Problem, text};
use faceoff_api::{
    requests::{self, FoundedTeam, InvitedRole},
    secret_extraction::InvitationLink,
    token::{Secret, SecretKind, hash_token},
};
use faceoff_store::{JoinOutcome, JoinRequest, TeamProfile, TokenKind};
use faceoff_types::TeamName;
use jiff::{SignedDuration, Timestamp};

/// Default validity of an invitation.
const DEFAULT_VALIDITY: SignedDuration = SignedDuration::from_hours(7 * 24);
/// Validity of a link that gives a user access again, by default and at most.
pub(crate) const RESTORE_ACCESS_VALIDITY: SignedDuration = SignedDuration::from_hours(24);
/// Longest affiliation of a team.
const MAX_AFFILIATION_CHARS: usize = 120;

/// When an invitation that is created now expires by default.
pub(crate) fn default_expiry(role: InvitedRole, now: Timestamp) -> Timestamp {
    let validity = match role {
        InvitedRole::RestoreAccess => RESTORE_ACCESS_VALIDITY,
        InvitedRole::Organiser | InvitedRole::Member | InvitedRole::Founder => DEFAULT_VALIDITY,
    };
    now.saturating_add(validity).unwrap_or(Timestamp::MAX)
}

/// The page of an invitation code: a URL, or a path if the server's public URL is not configured.
pub fn join_link(app: &AppState, code: &str) -> String {
    let base = app.config.public_url.as_deref().unwrap_or_default();
    format!("{base}/join/{code}")
}

/// A team's name and validated profile.
pub fn checked_profile(team: FoundedTeam) -> Result<(TeamName, TeamProfile), Problem> {
    let FoundedTeam {
        name,
        affiliation,
        link,
        division,
    } = team;
    let affiliation =
        affiliation.map(|text| text::single_line("affiliation", &text, MAX_AFFILIATION_CHARS));
    let profile = TeamProfile {
        affiliation: affiliation.transpose()?,
        link: link.map(|link| text::link("link", &link)).transpose()?,
        division,
    };
    Ok((name, profile))
}

/// Accepts an invitation, and creates a token or a session for the user, as `token_kind` says.
#[boxed_future]
pub async fn join(
    app: &AppState,
    request: requests::JoinRequest,
    token_kind: TokenKind,
    expires_at: Option<Timestamp>,
    client: Option<Network>,
) -> Result<(JoinOutcome, Secret), Problem> {
    let now = app.config.clock.now();
    let code = InvitationLink::find(&request.code);
    let code = code.map_or_else(|| request.code.trim().to_owned(), |link| link.code);
    let code_hash = hash_token(&code);
    // Checked before the password is hashed, which is expensive.
    app.store.code_status(code_hash, now).await?;
    let team = request.team.map(checked_profile).transpose()?;
    let password_hash = match request.password {
        Some(password) => Some(app.passwords.hash(password, client).await?),
        None => None,
    };
    let (secret_kind, token_name) = match token_kind {
        TokenKind::ApiToken => (SecretKind::User, "first"),
        TokenKind::Session => (SecretKind::Session, "browser"),
    };
    let secret = Secret::generate(secret_kind).map_err(Problem::internal)?;
    let join_request = JoinRequest {
        code_hash,
        name: request.name,
        password_hash,
        team,
        accepted_terms: request.accepted_terms,
        token_hash: secret.hash(),
        token_kind,
        token_name: token_name.to_owned(),
        token_expires_at: expires_at,
    };
    let joined = app.store.join(join_request, now).await?;
    tracing::info!(user = %joined.user.id, name = %joined.user.name, "joined");
    Ok((joined, secret))
}
