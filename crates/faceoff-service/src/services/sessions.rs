//! Sessions: signing in with a password.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
};
use faceoff_api::token::{Secret, SecretKind};
use faceoff_store::{Actor, NewToken, SESSION_LIFETIME, TokenKind, TokenOwner};
use faceoff_types::UserId;
use jiff::Timestamp;

/// Name of a browser's session.
const NAME: &str = "browser";

/// When a session that begins now expires.
pub fn session_expiry(now: Timestamp) -> Timestamp {
    now.saturating_add(SESSION_LIFETIME)
        .unwrap_or(Timestamp::MAX)
}

/// Signs a user in; returns the user and the session's secret.
#[boxed]
pub async fn sign_in(
    app: &AppState,
    name: &str,
    password: String,
) -> Result<(UserId, Secret), Problem> {
    let now = app.config.clock.now();
    let known = app.store.password_hash_of(name.trim()).await?;
    let Some(id) = app.passwords.verify(known, password, now).await? else {
        return Err(Problem::new(
            ProblemKind::Unauthenticated,
            "wrong name or password; if you have lost it, ask an organiser for a new link",
        ));
    };
    let secret = Secret::generate(SecretKind::Session).map_err(Problem::internal)?;
    let new = NewToken {
        hash: secret.hash(),
        kind: TokenKind::Session,
        owner: TokenOwner::User(id),
        name: NAME.to_owned(),
        expires_at: Some(session_expiry(now)),
    };
    app.store.create_token(Actor::User(id), new, now).await?;
    tracing::info!(user = %id, "signed in");
    Ok((id, secret))
}
