//! Sessions of browsers: a user signs in with a password and gets a session, which is a token in a cookie.

use crate::{
    app::AppState,
    auth::Caller,
    boxed_future,
    network::Network,
    problem::{Problem, ProblemKind},
};
use faceoff_api::token::{Secret, SecretKind};
use faceoff_store::{
    NewToken, Requester, RevocationExtent, SESSION_LIFETIME, TokenKind, TokenOwner,
};
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
#[boxed_future]
pub async fn end(app: &AppState, caller: &Caller) -> Result<(), Problem> {
    let (token, now) = (caller.token.id, app.config.clock.now());
    app.store
        .revoke_token(caller.actor(), token, RevocationExtent::TokenOnly, now)
        .await?;
    Ok(())
}

/// Signs in the user with this name; returns the user's id and the secret of the new session.
#[boxed_future]
pub async fn sign_in(
    app: &AppState,
    name: &str,
    password: String,
    client: Option<Network>,
) -> Result<(UserId, Secret), Problem> {
    let now = app.config.clock.now();
    let account = app.store.password_hash_of(name.trim()).await?;
    let stored = account.as_ref().map(|(_, hash)| hash.clone());
    let verified = app.passwords.verify(name, account, password, client, now);
    let wrong = || {
        Problem::new(
            ProblemKind::Unauthenticated,
            "wrong name or password. Lost your password? Ask an organiser for a new link",
        )
    };
    let (id, stored) = verified.await?.zip(stored).ok_or_else(wrong)?;
    let secret = Secret::generate(SecretKind::Session).map_err(Problem::internal)?;
    let new = NewToken {
        hash: secret.hash(),
        kind: TokenKind::Session,
        owner: TokenOwner::User(id),
        name: SESSION_NAME.to_owned(),
        requester: Requester {
            user: Some(id),
            token: None,
        },
        expires_at: Some(session_expiry(now)),
    };
    // The user may have another password by now.
    if !app.store.sign_in(id, &stored, new, now).await? {
        return Err(wrong());
    }
    tracing::info!(user = %id, "signed in");
    Ok((id, secret))
}
