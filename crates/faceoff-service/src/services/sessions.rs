//! Sessions of browsers: a user signs in with a password and gets a session, which is a token in a cookie.

use crate::{
    app::AppState,
    auth::Caller,
    boxed,
    network::Network,
    problem::{Problem, ProblemKind},
};
use faceoff_api::token::{Secret, SecretKind};
use faceoff_store::{Actor, Maker, NewToken, SESSION_LIFETIME, TokenKind, TokenOwner};
use faceoff_types::UserId;
use jiff::Timestamp;

/// Name of each session in the list of the user's tokens.
const SESSION_NAME: &str = "browser";

/// When a session that begins now expires.
pub fn session_expiry(now: Timestamp) -> Timestamp {
    now.saturating_add(SESSION_LIFETIME)
        .unwrap_or(Timestamp::MAX)
}

/// Ends the session, or revokes the token, of the caller's request.
#[boxed]
pub async fn end(app: &AppState, caller: &Caller) -> Result<(), Problem> {
    let (ends_made, now) = (false, app.config.clock.now());
    app.store
        .revoke_token(caller.actor(), caller.token.id, ends_made, None, now)
        .await?;
    Ok(())
}

/// Signs in the user with this name; returns the user's id and the secret of the new session.
#[boxed]
pub async fn sign_in(
    app: &AppState,
    name: &str,
    password: String,
    client: Option<Network>,
) -> Result<(UserId, Secret), Problem> {
    let now = app.config.clock.now();
    let account = app.store.password_hash_of(name.trim()).await?;
    let verified = app.passwords.verify(name, account, password, client, now);
    let Some(id) = verified.await? else {
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
        name: SESSION_NAME.to_owned(),
        maker: Maker {
            user: Some(id),
            token: None,
        },
        expires_at: Some(session_expiry(now)),
    };
    app.store.create_token(Actor::User(id), new, now).await?;
    tracing::info!(user = %id, "signed in");
    Ok((id, secret))
}
