//! Users, who are organisers and members of teams: listing them, closing accounts, and accepting the season's terms.

use crate::{
    app::AppState,
    auth::Caller,
    boxed_future,
    network::Network,
    problem::{Problem, ProblemKind},
};
use faceoff_api::requests::NewPassword;
use faceoff_store::{EndedCredentials, Principal, StoreError, User};
use faceoff_types::{UserId, UserName};

/// The users whom the caller may see: organisers all, a team its members.
#[boxed_future]
pub async fn list_users(app: &AppState, caller: &Caller) -> Result<Vec<User>, Problem> {
    let users = match caller.team() {
        Some(team) => app.store.members_of(team.id).await?,
        None => app.store.users().await?,
    };
    Ok(users)
}

/// The user, if the caller may act for them: an organiser, or the user. A teammate gets `Forbidden`, others `NotFound`.
#[boxed_future]
pub async fn find(app: &AppState, caller: &Caller, id: UserId) -> Result<User, Problem> {
    let user = match app.store.user(id).await {
        Ok(user) => user,
        Err(StoreError::NotFound(_)) => return Err(Problem::not_found("user")),
        Err(error) => return Err(error.into()),
    };
    let is_self = caller.user().is_some_and(|user| user.id == id);
    if caller.is_organiser() || is_self {
        return Ok(user);
    }
    match (&caller.principal, user.team) {
        (Principal::Member(_, own_team) | Principal::Team(own_team), Some(team))
            if own_team.id == team =>
        {
            Err(Problem::new(
                ProblemKind::Forbidden,
                "only this user or an organiser may do this",
            ))
        }
        _ => Err(Problem::not_found("user")),
    }
}

/// Renames a user, who signs in with the new name from then on.
///
/// # Errors
/// `Forbidden` or `NotFound` unless the caller is the user or an organiser; `UserNameTaken`: another user has the name.
#[boxed_future]
pub async fn rename_user(
    app: &AppState,
    caller: &Caller,
    id: UserId,
    name: UserName,
) -> Result<User, Problem> {
    find(app, caller, id).await?;
    let now = app.config.clock.now();
    let renamed = app.store.rename_user(caller.actor(), id, name, now).await?;
    tracing::info!(user = %id, actor = %caller.actor(), "user renamed");
    Ok(renamed)
}

/// Closes a user's account, if that is confirmed with the user's name. Returns what ended with it, too.
#[boxed_future]
pub async fn remove_user(
    app: &AppState,
    caller: &Caller,
    id: UserId,
    confirm: Option<&str>,
) -> Result<(User, EndedCredentials), Problem> {
    let user = find(app, caller, id).await?;
    let effect = format!(
        "the account of {0} will be closed at once and for good, and all of its tokens and sessions will be revoked. Team \
         tokens and invitations made by {0} will be revoked, and webhooks made by {0} will be disabled. The name stays in the \
         event log",
        user.name
    );
    Problem::check_confirmed(confirm, user.name.as_str(), &effect)?;
    let now = app.config.clock.now();
    let removed = app.store.remove_user(caller.actor(), id, now).await?;
    tracing::info!(user = %id, actor = %caller.actor(), "user removed");
    Ok(removed)
}

/// Accepts the terms for the calling user.
#[boxed_future]
pub async fn accept_terms(app: &AppState, caller: &Caller, version: u32) -> Result<User, Problem> {
    let Some(user) = caller.user() else {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "expected a user's token, got a team's or the operator's; a member of the team accepts the terms with their own \
             token",
        ));
    };
    let now = app.config.clock.now();
    let accepted = app
        .store
        .accept_terms(caller.actor(), user.id, version, now)
        .await?;
    Ok(accepted)
}

/// Sets the caller's own password; the current one is expected, if there is one. Other tokens and sessions of the user are revoked.
///
/// # Errors
/// `Forbidden`: another user, or the current password is wrong; `InvalidContent`: the new one is too short.
#[boxed_future]
pub async fn set_password(
    app: &AppState,
    caller: &Caller,
    id: UserId,
    request: NewPassword,
    client: Option<Network>,
) -> Result<(User, EndedCredentials), Problem> {
    let user = find(app, caller, id).await?;
    if caller
        .user()
        .is_none_or(|calling_user| calling_user.id != id)
    {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            format!(
                "only the user can set their password; create a link for “{}” instead (POST /api/v1/invitations with the \
                 role “return”)",
                user.name
            ),
        ));
    }
    let now = app.config.clock.now();
    let stored_hash = app.store.password_hash_of(user.name.as_str()).await?;
    if stored_hash.is_some() {
        let old_password = request.old.unwrap_or_default();
        let name = user.name.as_str();
        let verified = app
            .passwords
            .verify(name, stored_hash, old_password, client, now);
        if verified.await? != Some(id) {
            return Err(Problem::new(
                ProblemKind::Forbidden,
                "old: expected the current password, got another one; nothing was changed",
            ));
        }
    }
    let hash = app.passwords.hash(request.password, client).await?;
    let changed = app
        .store
        .set_password(caller.actor(), id, &hash, caller.token.id, now)
        .await?;
    tracing::info!(user = %id, "password set");
    Ok(changed)
}
