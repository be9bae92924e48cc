//! `/dashboard/access` and `/organiser/access`, with the same page for teams and organisers: users, invitations, tokens and sessions.

use crate::{
    dashboard_frame::{
        DashboardHeader, DoneQuery, EmptyForm, Notice, redirect_done, render_dashboard,
    },
    format::{expiry_state, utc_minute},
    frame::{Frame, PageProblem},
    page_auth::PageUser,
};
use askama::Template;
use axum::{
    Router,
    extract::{Query, State},
    http::{HeaderMap, StatusCode},
    response::{IntoResponse, Response},
    routing::{get, post},
};
use faceoff_api::{
    requests::{InvitedRole, NewInvitation, NewToken},
    views::{credentials::EndedCredentialsView, invitation::InvitationView, token::TokenView},
};
use faceoff_service::{
    app::App,
    auth::Caller,
    extract::{PageForm, PathParam},
    problem::Problem,
    services::{invitations, tokens, users},
    session,
    views::{credentials, event, invitation, token, user},
};
use faceoff_types::{InvitationId, TeamId, TeamName, TokenId, UserId};
use jiff::{SignedDuration, Timestamp};
use serde::Deserialize;
use std::{collections::BTreeMap, str::FromStr};

/// The pages below `dashboard_path`, which is `/dashboard` or `/organiser`.
pub(crate) fn router(dashboard_path: &str) -> Router<App> {
    let path = |rest: &str| format!("{dashboard_path}/access{rest}");
    Router::new()
        .route(&path(""), get(page))
        .route(&path("/tokens"), post(create_token))
        .route(&path("/tokens/{id}/revoke"), post(revoke_token))
        .route(&path("/invitations"), post(invite))
        .route(&path("/invitations/{id}/revoke"), post(revoke_invitation))
        .route(&path("/people/{id}/remove"), post(remove_user))
}

/// How many of the newest invitations are listed, and how many of the newest tokens are searched for expired and revoked ones. All valid
/// tokens are listed.
const MAX_LISTED: u32 = 500;

#[derive(Template)]
#[template(path = "dashboard_access.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    /// Path of the page; forms post to paths below it.
    path: &'static str,
    is_organiser: bool,
    /// Title and value of a secret, shown only once.
    secret: Option<(String, String)>,
    /// After a token was revoked or a user removed: which other tokens and sessions ended with it, and which stay.
    ended: Vec<String>,
    users: Vec<UserRow>,
    tokens: Vec<TokenRow>,
    /// May there be ended tokens, or invitations, that the page does not list?
    is_shortened: bool,
    /// Expired and revoked tokens.
    inactive_tokens: Vec<TokenRow>,
    invitations: Vec<InvitationRow>,
    /// Accepted, revoked and expired invitations.
    closed_invitations: Vec<InvitationRow>,
    teams: Vec<(TeamId, TeamName)>,
    token_name: String,
    note: String,
}

struct UserRow {
    id: UserId,
    name: String,
    /// Organiser, or member of a team.
    role: String,
    joined_at: String,
    left_at: Option<String>,
    is_self: bool,
    /// May the viewer remove this user?
    can_remove: bool,
}

struct TokenRow {
    id: TokenId,
    name: String,
    owner: String,
    kind: String,
    created_at: String,
    last_used: String,
    state: String,
    is_current: bool,
}

struct InvitationRow {
    id: InvitationId,
    note: String,
    role: String,
    state: String,
    valid_until: String,
}

/// Path of this page for the caller.
fn access_path(caller: &Caller) -> &'static str {
    match caller.is_organiser() {
        true => "/organiser/access",
        false => "/dashboard/access",
    }
}

/// A secret or the effects of a change to show, and values of a refused form.
#[derive(Default)]
struct PageState {
    secret: Option<(String, String)>,
    /// See [`Page::ended`].
    ended: Vec<String>,
    token_name: String,
    note: String,
}

fn token_row(
    token: TokenView,
    names: &BTreeMap<String, String>,
    caller: &Caller,
    now: Timestamp,
) -> TokenRow {
    let name = |key: String| names.get(&key).cloned().unwrap_or(key);
    let is_own = token.person.is_some() && token.person == caller.user().map(|own| own.id);
    let owner = match (token.person, token.team) {
        _ if is_own => "you".to_owned(),
        (Some(id), _) => name(format!("person:{id}")),
        (None, Some(id)) => format!("team {}", name(format!("team:{id}"))),
        (None, None) => "operator of the server".to_owned(),
    };
    let state = expiry_state(token.revoked_at, token.expires_at, now);
    let last_used = token.last_used_at.map(utc_minute);
    TokenRow {
        id: token.id,
        owner,
        kind: match token.kind.as_str() {
            "session" => "browser session".to_owned(),
            _ => "token".to_owned(),
        },
        created_at: utc_minute(token.created_at),
        last_used: last_used.unwrap_or_else(|| "never".to_owned()),
        state: state.unwrap_or_else(|| "valid, no expiry".to_owned()),
        is_current: token.id == caller.token.id,
        name: token.name,
    }
}

fn invitation_row(view: InvitationView, names: &BTreeMap<String, String>) -> InvitationRow {
    let name = |key: String| names.get(&key).cloned().unwrap_or(key);
    let role = match (view.role, view.team, view.person) {
        (InvitedRole::Member, Some(team), _) => {
            format!("member of {}", name(format!("team:{team}")))
        }
        (InvitedRole::Member, None, _) => "member".to_owned(),
        (InvitedRole::Organiser, ..) => "organiser".to_owned(),
        (InvitedRole::Founder, ..) => "first member of a new team".to_owned(),
        (InvitedRole::RestoreAccess, _, Some(person)) => {
            format!("password reset of {}", name(format!("person:{person}")))
        }
        (InvitedRole::RestoreAccess, _, None) => "password reset".to_owned(),
    };
    InvitationRow {
        id: view.id,
        note: view.note,
        role,
        state: view.state,
        valid_until: utc_minute(view.expires_at),
    }
}

async fn page_with(
    app: &App,
    caller: &Caller,
    notice: Notice<'_>,
    state: PageState,
) -> Result<Response, PageProblem> {
    let now = app.config.clock.now();
    let names = event::actor_names(app).await?;
    let path = access_path(caller);
    let build_row = |token| token_row(token, &names, caller, now);
    // All valid ones, so that none can be hidden behind many expired ones.
    let tokens = tokens::valid_tokens(app, caller).await?;
    let tokens: Vec<TokenRow> = tokens.into_iter().map(token::view).map(build_row).collect();
    let newest = tokens::tokens_after(app, caller, None, MAX_LISTED).await?;
    let newest = newest.unwrap_or_default();
    let is_shortened = newest.len() >= MAX_LISTED as usize;
    let inactive_tokens = newest.into_iter().filter(|token| !token.is_valid(now));
    let inactive_tokens = inactive_tokens.map(token::view).map(build_row).collect();
    let listed = invitations::invitations_after(app, caller, None, MAX_LISTED).await?;
    let listed = listed
        .into_iter()
        .flatten()
        .map(|invitation| invitation_row(invitation::view(invitation, now), &names));
    let (invitations, closed_invitations): (Vec<_>, Vec<_>) =
        listed.partition(|invitation| invitation.state == "open");
    let is_organiser = caller.is_organiser();
    let own_id = caller.user().map(|person| person.id);
    let users = users::list_users(app, caller).await?;
    let users = users.into_iter().map(|person| {
        let view = user::view(person);
        let is_self = own_id == Some(view.id);
        UserRow {
            id: view.id,
            name: view.name.to_string(),
            role: match view.team {
                Some(team) => format!(
                    "member of {}",
                    names
                        .get(&format!("team:{team}"))
                        .cloned()
                        .unwrap_or_default()
                ),
                None => "organiser".to_owned(),
            },
            joined_at: utc_minute(view.joined_at),
            left_at: view.left_at.map(utc_minute),
            is_self,
            can_remove: view.left_at.is_none() && (is_organiser || is_self),
        }
    });
    let teams = match is_organiser {
        true => app.store.teams().await?,
        false => Vec::new(),
    };
    let page = Page {
        frame: Frame::load(app, path).await?,
        head: DashboardHeader::new(caller, path, notice),
        path,
        is_organiser,
        users: users.collect(),
        is_shortened: is_shortened
            || invitations.len() + closed_invitations.len() >= MAX_LISTED as usize,
        tokens,
        inactive_tokens,
        invitations,
        closed_invitations,
        teams: teams.into_iter().map(|team| (team.id, team.name)).collect(),
        secret: state.secret,
        ended: state.ended,
        token_name: state.token_name,
        note: state.note,
    };
    render_dashboard(&page, notice)
}

async fn page(
    PageUser(caller): PageUser,
    State(app): State<App>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    page_with(&app, &caller, Notice::Done(&notice), PageState::default()).await
}

/// The page with a new secret. There is no redirect, since the secret is shown only once.
async fn page_with_secret(
    app: &App,
    caller: &Caller,
    secret: (String, String),
) -> Result<Response, PageProblem> {
    let state = PageState {
        secret: Some(secret),
        ..PageState::default()
    };
    let page = page_with(app, caller, Notice::None, state).await?;
    Ok((StatusCode::CREATED, page).into_response())
}

#[derive(Deserialize)]
struct TokenForm {
    name: String,
    /// `me` or `team`.
    #[serde(default)]
    owner: String,
    /// Empty: no expiry.
    #[serde(default)]
    days: String,
}

fn token_request(app: &App, caller: &Caller, form: &TokenForm) -> Result<NewToken, Problem> {
    let now = app.config.clock.now();
    let days = Some(form.days.trim()).filter(|days| !days.is_empty());
    let days = days.map(|days| {
        let days: u16 = days
            .parse()
            .map_err(|_| Problem::invalid("days", "expected a number of days"))?;
        now.saturating_add(SignedDuration::from_hours(24 * i64::from(days)))
            .map_err(|error| Problem::invalid("days", error))
    });
    let team = caller.team().filter(|_| form.owner == "team");
    Ok(NewToken {
        name: form.name.clone(),
        expires_at: days.transpose()?,
        team: team.map(|team| team.id),
    })
}

async fn create_token(
    PageUser(caller): PageUser,
    State(app): State<App>,
    form: Result<PageForm<TokenForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let created = match token_request(&app, &caller, &form) {
        Ok(request) => tokens::create_token(&app, &caller, request).await,
        Err(problem) => Err(problem),
    };
    match created {
        Ok(view) => {
            let title = format!("Token “{}”", view.token.name);
            page_with_secret(&app, &caller, (title, view.secret)).await
        }
        Err(problem) => {
            let state = PageState {
                token_name: form.name,
                ..PageState::default()
            };
            page_with(&app, &caller, Notice::Refused(&problem), state).await
        }
    }
}

/// Redirects to the page with the notice `key` after a change; shows the page with the problem after a refusal.
async fn after_change<T>(
    app: &App,
    caller: &Caller,
    changed: Result<T, Problem>,
    key: &'static str,
) -> Result<Response, PageProblem> {
    match changed {
        Ok(_) => Ok(redirect_done(access_path(caller), key)),
        Err(problem) => {
            let state = PageState::default();
            page_with(app, caller, Notice::Refused(&problem), state).await
        }
    }
}

/// As [`after_change`], for a revoked token or a removed user: the page lists the other credentials that ended with it.
async fn after_revocation(
    app: &App,
    caller: &Caller,
    changed: Result<Option<EndedCredentialsView>, Problem>,
    key: &'static str,
) -> Result<Response, PageProblem> {
    match changed {
        Ok(Some(ended)) => {
            let state = PageState {
                ended: ended.lines(),
                ..PageState::default()
            };
            let done = DoneQuery {
                done: Some(key.to_owned()),
            };
            page_with(app, caller, Notice::Done(&done), state).await
        }
        changed => after_change(app, caller, changed, key).await,
    }
}

async fn revoke_token(
    PageUser(caller): PageUser,
    State(app): State<App>,
    id: Result<PathParam<TokenId>, Problem>,
    form: Result<PageForm<EmptyForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(EmptyForm {})) = (id?, form?);
    let changed = tokens::revoke_token(&app, &caller, id, None).await;
    let ended = changed.map(|revoked| revoked.ended);
    after_revocation(&app, &caller, ended, "revoked").await
}

#[derive(Deserialize)]
struct InvitationForm {
    note: String,
    /// Only in the form of organisers: `organiser`, `founder` (first member of a new team), `member`, `return` (access again for a user).
    #[serde(default)]
    role: String,
    #[serde(default)]
    team: String,
    /// The user who gets access again, with a new password.
    #[serde(default)]
    person: String,
}

/// The id of the chosen entry of a list.
fn chosen<Id: FromStr>(field: &str, id: &str) -> Result<Id, Problem> {
    id.parse()
        .map_err(|_| Problem::invalid(field, "choose an entry of the list"))
}

fn invitation_request(caller: &Caller, form: &InvitationForm) -> Result<NewInvitation, Problem> {
    let role = match (caller.is_organiser(), form.role.as_str()) {
        (false, _) | (true, "member") => InvitedRole::Member,
        (true, "organiser") => InvitedRole::Organiser,
        (true, "return") => InvitedRole::RestoreAccess,
        (true, "founder") => InvitedRole::Founder,
        (true, other) => {
            let detail = format!("expected member, founder, organiser or return, got {other:?}");
            return Err(Problem::invalid("role", detail));
        }
    };
    let team = match (role, caller.is_organiser()) {
        (InvitedRole::Member, true) => Some(chosen("team", &form.team)?),
        _ => None,
    };
    let person = match role {
        InvitedRole::RestoreAccess => Some(chosen("person", &form.person)?),
        _ => None,
    };
    Ok(NewInvitation {
        role,
        team,
        person,
        note: form.note.clone(),
        expires_at: None,
    })
}

async fn invite(
    PageUser(caller): PageUser,
    State(app): State<App>,
    headers: HeaderMap,
    form: Result<PageForm<InvitationForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let invitation = match invitation_request(&caller, &form) {
        Ok(request) => invitations::create_invitation(&app, &caller, request).await,
        Err(problem) => Err(problem),
    };
    match invitation {
        Ok(view) => {
            let title = format!("Invitation link “{}”", view.invitation.note);
            let link = session::absolute_link(&headers, view.link);
            page_with_secret(&app, &caller, (title, link)).await
        }
        Err(problem) => {
            let state = PageState {
                note: form.note,
                ..PageState::default()
            };
            page_with(&app, &caller, Notice::Refused(&problem), state).await
        }
    }
}

async fn revoke_invitation(
    PageUser(caller): PageUser,
    State(app): State<App>,
    id: Result<PathParam<InvitationId>, Problem>,
    form: Result<PageForm<EmptyForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(EmptyForm {})) = (id?, form?);
    let changed = invitations::revoke_invitation(&app, &caller, id).await;
    after_change(&app, &caller, changed, "uninvited").await
}

#[derive(Deserialize)]
struct RemovalForm {
    /// Name of the user, typed as confirmation.
    confirm: String,
}

async fn remove_user(
    PageUser(caller): PageUser,
    State(app): State<App>,
    id: Result<PathParam<UserId>, Problem>,
    form: Result<PageForm<RemovalForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let confirm = Some(form.confirm.trim());
    let changed = users::remove_user(&app, &caller, id, confirm).await;
    let now = app.config.clock.now();
    let ended = changed.map(|(_, ended)| credentials::ended(ended, now));
    after_revocation(&app, &caller, ended, "removed").await
}
