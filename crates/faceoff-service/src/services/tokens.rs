//! API tokens: listing, creating, rotating and revoking them. A *token* belongs to a user, a team or the server's
//! operator. Rotating replaces its secret.

use crate::{
    app::AppState,
    auth::Caller,
    boxed_future,
    problem::{Problem, ProblemKind},
    text,
    views::{credentials, token},
};
use faceoff_api::{
    requests::{self, CreatedCredentials},
    token::{Secret, SecretKind},
    views::{credentials::RevokedTokenView, token::NewTokenView},
};
use faceoff_store::{
    NewToken, Principal, RevocationExtent, StoreError, Token, TokenFilter, TokenKind, TokenOwner,
};
use faceoff_types::{TeamId, TokenId};

/// Longest name of a token.
const MAX_NAME_CHARS: usize = 80;

/// The tokens that the caller may see and revoke: organisers all, a member their own and the team's. `None`: only the one that the
/// request was sent with, for a team's API client. A leaked token must not end others, or get the secret of one that lasts longer.
const fn manageable(caller: &Caller) -> Option<TokenFilter> {
    match &caller.principal {
        Principal::Operator | Principal::Organiser(_) => Some(TokenFilter::Everyone),
        Principal::Member(user, team) => Some(TokenFilter::Member(user.id, team.id)),
        Principal::Team(_) => None,
    }
}

fn may_manage(caller: &Caller, token: &Token) -> bool {
    match manageable(caller) {
        Some(manageable) => manageable.includes(token),
        None => caller.token.id == token.id,
    }
}

async fn find(app: &AppState, caller: &Caller, id: TokenId) -> Result<Token, Problem> {
    match app.store.token(id).await {
        Ok(token) if may_manage(caller, &token) => Ok(token),
        Ok(_) | Err(StoreError::NotFound(_)) => Err(Problem::not_found("token")),
        Err(error) => Err(error.into()),
    }
}

/// At most `limit` of the tokens and sessions that the caller may manage, newest first. With `after`, those that come after this
/// token; `None` if it is not in the list.
#[boxed_future]
pub async fn tokens_after(
    app: &AppState,
    caller: &Caller,
    after: Option<TokenId>,
    limit: u32,
) -> Result<Option<Vec<Token>>, Problem> {
    match (manageable(caller), after) {
        (Some(manageable), _) => Ok(app.store.tokens_after(manageable, after, limit).await?),
        (None, None) => Ok(Some(vec![caller.token.clone()])),
        (None, Some(after)) => Ok((after == caller.token.id).then(Vec::new)),
    }
}

/// The valid tokens and sessions that the caller may manage, newest first.
#[boxed_future]
pub async fn valid_tokens(app: &AppState, caller: &Caller) -> Result<Vec<Token>, Problem> {
    match manageable(caller) {
        Some(manageable) => {
            let now = app.config.clock.now();
            Ok(app.store.valid_tokens(manageable, now).await?)
        }
        None => Ok(vec![caller.token.clone()]),
    }
}

/// The owner of a new token: the given team, or otherwise the caller.
///
/// # Errors
/// `Forbidden` or `NotFound` if the caller may not create such a token.
fn new_token_owner(caller: &Caller, team: Option<TeamId>) -> Result<TokenOwner, Problem> {
    match (&caller.principal, team) {
        (Principal::Operator, None) => Ok(TokenOwner::Operator),
        (Principal::Organiser(user) | Principal::Member(user, _), None) => {
            Ok(TokenOwner::User(user.id))
        }
        (Principal::Operator | Principal::Organiser(_), Some(id)) => Ok(TokenOwner::Team(id)),
        (Principal::Member(_, own_team), Some(id)) if own_team.id == id => Ok(TokenOwner::Team(id)),
        (Principal::Member(..), Some(_)) => Err(Problem::not_found("team")),
        // A leaked team token must not create tokens that outlive it.
        (Principal::Team(_), _) => Err(Problem::new(
            ProblemKind::Forbidden,
            "a team's token cannot create tokens; use a member's token, or an organiser's",
        )),
    }
}

/// Creates a token. Only this response contains its secret.
#[boxed_future]
pub async fn create_token(
    app: &AppState,
    caller: &Caller,
    new: requests::NewToken,
) -> Result<NewTokenView, Problem> {
    let owner = new_token_owner(caller, new.team)?;
    let name = text::single_line("name", &new.name, MAX_NAME_CHARS)?;
    let kind = match owner {
        TokenOwner::Operator => SecretKind::Operator,
        TokenOwner::Team(id) => {
            app.store.team(id).await?;
            SecretKind::Team
        }
        TokenOwner::User(_) => SecretKind::User,
    };
    let secret = Secret::generate(kind).map_err(Problem::internal)?;
    let new = NewToken {
        hash: secret.hash(),
        kind: TokenKind::ApiToken,
        owner,
        name,
        requester: caller.requester(),
        expires_at: new.expires_at,
    };
    let now = app.config.clock.now();
    let token = app.store.create_token(caller.actor(), new, now).await?;
    tracing::info!(token = %token.id, actor = %caller.actor(), "token created");
    Ok(NewTokenView {
        token: token::view(token),
        secret: secret.as_str().to_owned(),
    })
}

/// Replaces a token's secret. Only this response contains the new one.
#[boxed_future]
pub async fn rotate_token(
    app: &AppState,
    caller: &Caller,
    id: TokenId,
) -> Result<NewTokenView, Problem> {
    let token = find(app, caller, id).await?;
    // The secret of another user's token would allow acting as that user.
    if let TokenOwner::User(owner) = token.owner
        && caller.user().is_none_or(|user| user.id != owner)
    {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "a user's token can be rotated only by that user; you can revoke it (DELETE /api/v1/tokens/ID)",
        ));
    }
    // A user could act as the operator after the end of the own account.
    if token.owner == TokenOwner::Operator && caller.principal != Principal::Operator {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "the operator's tokens can be rotated only with a token of the operator; you can revoke it (DELETE /api/v1/tokens/ID)",
        ));
    }
    let kind = match token.owner {
        TokenOwner::Operator => SecretKind::Operator,
        TokenOwner::Team(_) => SecretKind::Team,
        TokenOwner::User(_) => SecretKind::User,
    };
    let secret = Secret::generate(kind).map_err(Problem::internal)?;
    let (actor, now) = (caller.actor(), app.config.clock.now());
    let token = app
        .store
        .rotate_token(actor, id, secret.hash(), caller.requester(), now)
        .await?;
    tracing::info!(token = %id, actor = %caller.actor(), "token rotated");
    Ok(NewTokenView {
        token: token::view(token),
        secret: secret.as_str().to_owned(),
    })
}

/// Revokes a token: it is invalid from now on. `created_credentials` says what happens to the credentials that were
/// created with it. By default they end, too, unless the token is the caller's own: another user's may have been stolen.
#[boxed_future]
pub async fn revoke_token(
    app: &AppState,
    caller: &Caller,
    id: TokenId,
    created_credentials: Option<CreatedCredentials>,
) -> Result<RevokedTokenView, Problem> {
    let token = find(app, caller, id).await?;
    let is_own = match (&caller.principal, token.owner) {
        (Principal::Operator, TokenOwner::Operator) | (Principal::Team(_), _) => true,
        (Principal::Organiser(user) | Principal::Member(user, _), TokenOwner::User(id)) => {
            user.id == id
        }
        _ => false,
    };
    let now = app.config.clock.now();
    let default = if is_own {
        CreatedCredentials::Keep
    } else {
        CreatedCredentials::End
    };
    let extent = match created_credentials.unwrap_or(default) {
        CreatedCredentials::Keep => RevocationExtent::TokenOnly,
        CreatedCredentials::End => RevocationExtent::WithCreatedExcept(Some(caller.token.id)),
    };
    let revoked = app
        .store
        .revoke_token(caller.actor(), id, extent, now)
        .await?;
    tracing::info!(token = %id, actor = %caller.actor(), "token revoked");
    Ok(RevokedTokenView {
        token: token::view(revoked.token),
        ended: credentials::ended(revoked.ended, now),
    })
}
