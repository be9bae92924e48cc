//! Signing in by a password.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
};
use faceoff_api::token::{Secret, SecretKind};
use faceoff_store::{Actor, NewToken, SESSION, TokenKind, TokenOwner};
use faceoff_types::PersonId;
use jiff::Timestamp;

/// What a session is called that came from a browser.
const NAME: &str = "browser";

/// Until when a session that begins now is good.
pub fn session_end(now: Timestamp) -> Timestamp {
    now.saturating_add(SESSION).unwrap_or(Timestamp::MAX)
}

/// Signs somebody in who knows their password: who it is, and the secret of the session.
#[boxed]
pub async fn sign_in(
    app: &AppState,
    name: &str,
    password: String,
) -> Result<(PersonId, Secret), Problem> {
    let now = app.config.clock.now();
    let known = app.store.password_of(name.trim()).await?;
    let Some(id) = app.passwords.verify(known, password, now).await? else {
        return Err(Problem::new(
            ProblemKind::Unauthenticated,
            "name and password do not belong together; whoever has lost their password asks an organiser for a link",
        ));
    };
    let secret = Secret::generate(SecretKind::Session).map_err(Problem::internal)?;
    let new = NewToken {
        hash: secret.hash(),
        kind: TokenKind::Session,
        owner: TokenOwner::Person(id),
        name: NAME.to_owned(),
        expires_at: Some(session_end(now)),
    };
    app.store.create_token(Actor::Person(id), new, now).await?;
    tracing::info!(person = %id, "signed in");
    Ok((id, secret))
}
