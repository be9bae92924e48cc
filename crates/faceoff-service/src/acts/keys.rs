//! Keys to the API: seen, made, rotated and revoked by whom they concern.

use crate::{
    app::AppState,
    auth::Caller,
    boxed,
    problem::{Problem, ProblemKind},
    text,
    views::token,
};
use faceoff_api::{
    requests,
    token::{Secret, SecretKind},
    views::token::{NewTokenView, TokenView},
};
use faceoff_store::{NewToken, StoreError, Token, TokenKind, TokenOwner, Who};
use faceoff_types::{TeamId, TokenId};

/// Longest name of a token.
const NAME_CHARS: usize = 80;

/// Whose tokens a caller may see and end: an organiser all, a member their own and their team's, a team's program those
/// of the team.
fn may_manage(caller: &Caller, token: &Token) -> bool {
    match (&caller.who, token.owner) {
        (Who::Host | Who::Organiser(_), _) => true,
        (Who::Team(team), TokenOwner::Team(id)) => team.id == id,
        (Who::Member(_, team), TokenOwner::Team(id)) => team.id == id,
        (Who::Member(person, _), TokenOwner::Person(id)) => person.id == id,
        (Who::Team(_) | Who::Member(..), _) => false,
    }
}

async fn find(app: &AppState, caller: &Caller, id: TokenId) -> Result<Token, Problem> {
    match app.store.token(id).await {
        Ok(token) if may_manage(caller, &token) => Ok(token),
        Ok(_) | Err(StoreError::NotFound(_)) => Err(Problem::not_found("token")),
        Err(error) => Err(error.into()),
    }
}

/// The tokens and sessions that the caller may manage, the newest first.
#[boxed]
pub async fn tokens(app: &AppState, caller: &Caller) -> Result<Vec<Token>, Problem> {
    let mut tokens = app.store.tokens().await?;
    tokens.retain(|token| may_manage(caller, token));
    Ok(tokens)
}

/// By whom a new token speaks.
fn owner(caller: &Caller, team: Option<TeamId>) -> Result<TokenOwner, Problem> {
    match (&caller.who, team) {
        (Who::Host, None) => Ok(TokenOwner::Host),
        (Who::Organiser(person) | Who::Member(person, _), None) => {
            Ok(TokenOwner::Person(person.id))
        }
        (Who::Host | Who::Organiser(_), Some(id)) => Ok(TokenOwner::Team(id)),
        (Who::Member(_, own), Some(id)) if own.id == id => Ok(TokenOwner::Team(id)),
        (Who::Member(..), Some(_)) => Err(Problem::not_found("team")),
        // Whoever finds a team's token must not make others that outlive it.
        (Who::Team(_), _) => Err(Problem::new(
            ProblemKind::Forbidden,
            "a team's own token makes no others; a member makes them, or an organiser",
        )),
    }
}

/// Makes a token and returns it, once.
#[boxed]
pub async fn create_token(
    app: &AppState,
    caller: &Caller,
    new: requests::NewToken,
) -> Result<NewTokenView, Problem> {
    let owner = owner(caller, new.team)?;
    let name = text::line("name", &new.name, NAME_CHARS)?;
    let kind = match owner {
        TokenOwner::Host => SecretKind::Admin,
        TokenOwner::Team(id) => {
            app.store.team(id).await?;
            SecretKind::Team
        }
        TokenOwner::Person(_) => SecretKind::Person,
    };
    let secret = Secret::generate(kind).map_err(Problem::internal)?;
    let new = NewToken {
        hash: secret.hash(),
        kind: TokenKind::Key,
        owner,
        name,
        expires_at: new.expires_at,
    };
    let now = app.config.clock.now();
    let token = app.store.create_token(caller.actor(), new, now).await?;
    tracing::info!(token = %token.id, actor = %caller.actor(), "token created");
    Ok(NewTokenView {
        token: token::of(token),
        secret: secret.as_str().to_owned(),
    })
}

/// Gives a token another secret and returns it, once.
#[boxed]
pub async fn rotate_token(
    app: &AppState,
    caller: &Caller,
    id: TokenId,
) -> Result<NewTokenView, Problem> {
    let token = find(app, caller, id).await?;
    // Who has another's secret can do what only they may.
    if let TokenOwner::Person(owner) = token.owner
        && caller.person().is_none_or(|person| person.id != owner)
    {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "a person's token is rotated by that person alone; you can revoke it (DELETE /api/v1/tokens/ID)",
        ));
    }
    let kind = match token.owner {
        TokenOwner::Host => SecretKind::Admin,
        TokenOwner::Team(_) => SecretKind::Team,
        TokenOwner::Person(_) => SecretKind::Person,
    };
    let secret = Secret::generate(kind).map_err(Problem::internal)?;
    let (actor, now) = (caller.actor(), app.config.clock.now());
    let token = app
        .store
        .rotate_token(actor, id, secret.hash(), now)
        .await?;
    tracing::info!(token = %id, actor = %caller.actor(), "token rotated");
    Ok(NewTokenView {
        token: token::of(token),
        secret: secret.as_str().to_owned(),
    })
}

/// From now on the token is worth nothing.
#[boxed]
pub async fn revoke_token(
    app: &AppState,
    caller: &Caller,
    id: TokenId,
) -> Result<TokenView, Problem> {
    find(app, caller, id).await?;
    let now = app.config.clock.now();
    let token = app.store.revoke_token(caller.actor(), id, now).await?;
    tracing::info!(token = %id, actor = %caller.actor(), "token revoked");
    Ok(token::of(token))
}
