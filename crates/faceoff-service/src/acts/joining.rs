//! Following a link by which somebody joins.

use crate::{app::AppState, boxed, problem::Problem, text};
use faceoff_api::{
    requests::{FoundedTeam, Join},
    token::{Secret, SecretKind, hash_token},
};
use faceoff_store::{Joined, Joining, TeamProfile, TokenKind};
use faceoff_types::TeamName;
use jiff::{SignedDuration, Timestamp};

/// For how long an invitation is good, unless its maker says another time.
const GOOD_FOR: SignedDuration = SignedDuration::from_hours(7 * 24);
const AFFILIATION_CHARS: usize = 120;

/// Until when an invitation is good that is made now.
pub(crate) fn good_until(now: Timestamp) -> Timestamp {
    now.saturating_add(GOOD_FOR).unwrap_or(Timestamp::MAX)
}

/// The page of a code: an address, if the server knows its own.
pub fn link(app: &AppState, code: &str) -> String {
    let base = app.config.public_url.as_deref().unwrap_or_default();
    format!("{base}/join/{code}")
}

/// What a team tells of itself, checked.
pub fn profile(team: FoundedTeam) -> Result<(TeamName, TeamProfile), Problem> {
    let FoundedTeam {
        name,
        affiliation,
        link,
        division,
    } = team;
    let affiliation = affiliation.map(|line| text::line("affiliation", &line, AFFILIATION_CHARS));
    let profile = TeamProfile {
        affiliation: affiliation.transpose()?,
        link: link.map(|link| text::link("link", &link)).transpose()?,
        division,
    };
    Ok((name, profile))
}

/// Follows a link, with a key or a session for whoever does.
#[boxed]
pub async fn join(
    app: &AppState,
    join: Join,
    kind: TokenKind,
    expires_at: Option<Timestamp>,
) -> Result<(Joined, Secret), Problem> {
    let now = app.config.clock.now();
    let code_hash = hash_token(join.code.trim());
    // Before a password is hashed, which costs us something.
    app.store.code(code_hash, now).await?;
    let team = join.team.map(profile).transpose()?;
    let password = match join.password {
        Some(password) => Some(app.passwords.hash(password).await?),
        None => None,
    };
    let (secret_kind, token_name) = match kind {
        TokenKind::Key => (SecretKind::Person, "first"),
        TokenKind::Session => (SecretKind::Session, "browser"),
    };
    let secret = Secret::generate(secret_kind).map_err(Problem::internal)?;
    let joining = Joining {
        code_hash,
        name: join.name,
        password,
        team,
        accepted_terms: join.accepted_terms,
        token_hash: secret.hash(),
        token_kind: kind,
        token_name: token_name.to_owned(),
        token_expires_at: expires_at,
    };
    let joined = app.store.join(joining, now).await?;
    tracing::info!(person = %joined.person.id, name = %joined.person.name, "joined");
    Ok((joined, secret))
}
