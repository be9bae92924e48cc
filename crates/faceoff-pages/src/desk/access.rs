//! Who may do something: people, the links by which they join, and the tokens of programs. Of a team's desk and of the
//! organiser's.

use crate::{
    desk_frame::{Done, Head, Said, done, render_desk},
    figures::minute,
    frame::{Frame, PageProblem},
    signed_in::SignedIn,
};
use askama::Template;
use axum::{
    Router,
    extract::{Query, State},
    http::StatusCode,
    response::{IntoResponse, Response},
    routing::{get, post},
};
use faceoff_api::{
    requests::{InvitedRole, NewInvitation, NewToken},
    views::{invitation::InvitationView, token::TokenView},
};
use faceoff_service::{
    acts::{inviting, keys, people},
    app::App,
    auth::Caller,
    extract::{PageForm, PathParam},
    problem::Problem,
    views::{event, invitation, person, season::SeasonHead, token},
};
use faceoff_types::{InvitationId, PersonId, TeamId, TeamName, TokenId};
use jiff::{SignedDuration, Timestamp};
use serde::Deserialize;
use std::collections::BTreeMap;

/// The pages below a desk's path.
pub(crate) fn router(desk: &str) -> Router<App> {
    Router::new()
        .route(&format!("{desk}/access"), get(page))
        .route(&format!("{desk}/access/tokens"), post(make_token))
        .route(
            &format!("{desk}/access/tokens/{{id}}/revoke"),
            post(revoke_token),
        )
        .route(&format!("{desk}/access/invitations"), post(invite))
        .route(
            &format!("{desk}/access/invitations/{{id}}/revoke"),
            post(revoke_invitation),
        )
        .route(
            &format!("{desk}/access/people/{{id}}/remove"),
            post(remove_person),
        )
}

#[derive(Template)]
#[template(path = "desk_access.html")]
struct Page {
    frame: Frame,
    head: Head,
    /// The path below which the forms send.
    base: &'static str,
    is_organiser: bool,
    /// A secret that is shown this once: what it is, and itself.
    secret: Option<(String, String)>,
    people: Vec<Somebody>,
    tokens: Vec<Key>,
    /// Those that are worth nothing any more.
    spent: Vec<Key>,
    invitations: Vec<Invited>,
    spent_invitations: Vec<Invited>,
    teams: Vec<(TeamId, TeamName)>,
    token_name: String,
    note: String,
}

struct Somebody {
    id: PersonId,
    name: String,
    /// Organiser, or of which team.
    role: String,
    joined_at: String,
    left_at: Option<String>,
    is_self: bool,
    /// May whoever looks remove them?
    can_remove: bool,
}

struct Key {
    id: TokenId,
    name: String,
    whose: String,
    kind: String,
    created_at: String,
    last_used: String,
    state: String,
    is_this: bool,
}

struct Invited {
    id: InvitationId,
    note: String,
    role: String,
    state: String,
    until: String,
}

/// The desk of whoever looks.
fn base(caller: &Caller) -> &'static str {
    match caller.is_organiser() {
        true => "/organiser/access",
        false => "/desk/access",
    }
}

/// What was typed, and what is to be told besides.
#[derive(Default)]
struct Told {
    secret: Option<(String, String)>,
    token_name: String,
    note: String,
}

fn key(token: TokenView, names: &BTreeMap<String, String>, caller: &Caller, now: Timestamp) -> Key {
    let named = |key: String| names.get(&key).cloned().unwrap_or(key);
    let is_own = token.person.is_some() && token.person == caller.person().map(|own| own.id);
    let whose = match (token.person, token.team) {
        _ if is_own => "you".to_owned(),
        (Some(id), _) => named(format!("person:{id}")),
        (None, Some(id)) => format!("programs of {}", named(format!("team:{id}"))),
        (None, None) => "the host".to_owned(),
    };
    let state = match (token.revoked_at, token.expires_at) {
        (Some(at), _) => format!("revoked {}", minute(at)),
        (None, Some(at)) if at <= now => format!("expired {}", minute(at)),
        (None, Some(at)) => format!("good until {}", minute(at)),
        (None, None) => "good, without an end".to_owned(),
    };
    let last = token.last_used_at.map(minute);
    Key {
        id: token.id,
        whose,
        kind: match token.kind.as_str() {
            "session" => "session of a browser".to_owned(),
            _ => "token".to_owned(),
        },
        created_at: minute(token.created_at),
        last_used: last.unwrap_or_else(|| "never".to_owned()),
        state,
        is_this: token.id == caller.token.id,
        name: token.name,
    }
}

fn invited(view: InvitationView, names: &BTreeMap<String, String>) -> Invited {
    let named = |key: String| names.get(&key).cloned().unwrap_or(key);
    let role = match (view.role, view.team, view.person) {
        (InvitedRole::Member, Some(team), _) => {
            format!("member of {}", named(format!("team:{team}")))
        }
        (InvitedRole::Member, None, _) => "member".to_owned(),
        (InvitedRole::Organiser, ..) => "organiser".to_owned(),
        (InvitedRole::Founder, ..) => "first member of a new team".to_owned(),
        (InvitedRole::Return, _, Some(person)) => {
            format!("return of {}", named(format!("person:{person}")))
        }
        (InvitedRole::Return, _, None) => "return".to_owned(),
    };
    Invited {
        id: view.id,
        note: view.note,
        role,
        state: view.state,
        until: minute(view.expires_at),
    }
}

async fn page_with(
    app: &App,
    caller: &Caller,
    said: Said<'_>,
    told: Told,
) -> Result<Response, PageProblem> {
    let now = app.config.clock.now();
    let names = event::names(app).await?;
    let base = base(caller);
    let mut tokens = Vec::new();
    let mut spent = Vec::new();
    for token in keys::tokens(app, caller).await? {
        let is_good = token.revoked_at.is_none() && token.expires_at.is_none_or(|at| at > now);
        let shown = key(token::of(token), &names, caller, now);
        match is_good {
            true => tokens.push(shown),
            false => spent.push(shown),
        }
    }
    let listed = inviting::invitations(app, caller).await?;
    let listed = listed
        .into_iter()
        .map(|invitation| invited(invitation::of(invitation, now), &names));
    let (invitations, spent_invitations) = listed.partition(|one| one.state == "open");
    let is_organiser = caller.is_organiser();
    let own = caller.person().map(|person| person.id);
    let everybody = people::people(app, caller).await?;
    let everybody = everybody.into_iter().map(|person| {
        let view = person::of(person);
        let is_self = own == Some(view.id);
        Somebody {
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
            joined_at: minute(view.joined_at),
            left_at: view.left_at.map(minute),
            is_self,
            can_remove: view.left_at.is_none() && (is_organiser || is_self),
        }
    });
    let teams = match is_organiser {
        true => app.store.teams().await.map_err(Problem::from)?,
        false => Vec::new(),
    };
    let season = SeasonHead::now(app).await?.name;
    let page = Page {
        frame: Frame::of(app, season, base),
        head: Head::of(caller, base, said),
        base,
        is_organiser,
        people: everybody.collect(),
        tokens,
        spent,
        invitations,
        spent_invitations,
        teams: teams.into_iter().map(|team| (team.id, team.name)).collect(),
        secret: told.secret,
        token_name: told.token_name,
        note: told.note,
    };
    render_desk(&page, said)
}

async fn page(
    SignedIn(caller): SignedIn,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    page_with(&app, &caller, Said::Done(&said), Told::default()).await
}

/// The page, with what was made: it is shown this once, so nothing leads on.
async fn made(
    app: &App,
    caller: &Caller,
    secret: (String, String),
) -> Result<Response, PageProblem> {
    let told = Told {
        secret: Some(secret),
        ..Told::default()
    };
    let page = page_with(app, caller, Said::Nothing, told).await?;
    Ok((StatusCode::CREATED, page).into_response())
}

#[derive(Deserialize)]
struct TokenForm {
    name: String,
    /// `me` or `team`.
    #[serde(default)]
    whose: String,
    /// Empty: it has no end.
    #[serde(default)]
    days: String,
}

fn wanted_token(app: &App, caller: &Caller, form: &TokenForm) -> Result<NewToken, Problem> {
    let now = app.config.clock.now();
    let days = Some(form.days.trim()).filter(|days| !days.is_empty());
    let days = days.map(|days| {
        let days: u16 = days
            .parse()
            .map_err(|_| Problem::invalid("days", "expected a number of days"))?;
        now.saturating_add(SignedDuration::from_hours(24 * i64::from(days)))
            .map_err(|error| Problem::invalid("days", error))
    });
    let team = caller.team().filter(|_| form.whose == "team");
    Ok(NewToken {
        name: form.name.clone(),
        expires_at: days.transpose()?,
        team: team.map(|team| team.id),
    })
}

async fn make_token(
    SignedIn(caller): SignedIn,
    State(app): State<App>,
    form: Result<PageForm<TokenForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let made_token = match wanted_token(&app, &caller, &form) {
        Ok(wanted) => keys::create_token(&app, &caller, wanted).await,
        Err(problem) => Err(problem),
    };
    match made_token {
        Ok(view) => {
            let what = format!("The token “{}”", view.token.name);
            made(&app, &caller, (what, view.secret)).await
        }
        Err(problem) => {
            let told = Told {
                token_name: form.name,
                ..Told::default()
            };
            page_with(&app, &caller, Said::Refused(&problem), told).await
        }
    }
}

#[derive(Deserialize)]
struct Nothing {}

async fn revoke_token(
    SignedIn(caller): SignedIn,
    State(app): State<App>,
    id: Result<PathParam<TokenId>, Problem>,
    form: Result<PageForm<Nothing>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(Nothing {})) = (id?, form?);
    match keys::revoke_token(&app, &caller, id).await {
        Ok(_) => Ok(done(base(&caller), "revoked")),
        Err(problem) => {
            let told = Told::default();
            page_with(&app, &caller, Said::Refused(&problem), told).await
        }
    }
}

#[derive(Deserialize)]
struct InvitationForm {
    note: String,
    /// Of organisers' forms: `organiser`, `founder`, `member`.
    #[serde(default)]
    role: String,
    #[serde(default)]
    team: String,
    /// Who is to return.
    #[serde(default)]
    person: String,
}

fn wanted_invitation(caller: &Caller, form: &InvitationForm) -> Result<NewInvitation, Problem> {
    let role = match (caller.is_organiser(), form.role.as_str()) {
        (false, _) | (true, "member") => InvitedRole::Member,
        (true, "organiser") => InvitedRole::Organiser,
        (true, "return") => InvitedRole::Return,
        (true, "founder") => InvitedRole::Founder,
        (true, other) => {
            let detail = format!("expected member, founder, organiser or return, got {other:?}");
            return Err(Problem::invalid("role", detail));
        }
    };
    let id = |field: &str, text: &str| {
        let wrong = |_| Problem::invalid(field, "choose one of the list");
        text.parse().map_err(wrong)
    };
    let team = match (role, caller.is_organiser()) {
        (InvitedRole::Member, true) => Some(id("team", &form.team)?),
        _ => None,
    };
    let person = match role {
        InvitedRole::Return => {
            let wrong = |_| Problem::invalid("person", "choose one of the list");
            Some(form.person.parse::<PersonId>().map_err(wrong)?)
        }
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
    SignedIn(caller): SignedIn,
    State(app): State<App>,
    form: Result<PageForm<InvitationForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(form) = form?;
    let invitation = match wanted_invitation(&caller, &form) {
        Ok(wanted) => inviting::create_invitation(&app, &caller, wanted).await,
        Err(problem) => Err(problem),
    };
    match invitation {
        Ok(view) => {
            let what = format!("The link for “{}”", view.invitation.note);
            made(&app, &caller, (what, view.link)).await
        }
        Err(problem) => {
            let told = Told {
                note: form.note,
                ..Told::default()
            };
            page_with(&app, &caller, Said::Refused(&problem), told).await
        }
    }
}

async fn revoke_invitation(
    SignedIn(caller): SignedIn,
    State(app): State<App>,
    id: Result<PathParam<InvitationId>, Problem>,
    form: Result<PageForm<Nothing>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(Nothing {})) = (id?, form?);
    match inviting::revoke_invitation(&app, &caller, id).await {
        Ok(_) => Ok(done(base(&caller), "uninvited")),
        Err(problem) => {
            let told = Told::default();
            page_with(&app, &caller, Said::Refused(&problem), told).await
        }
    }
}

#[derive(Deserialize)]
struct RemovalForm {
    /// The person's name, typed.
    confirm: String,
}

async fn remove_person(
    SignedIn(caller): SignedIn,
    State(app): State<App>,
    id: Result<PathParam<PersonId>, Problem>,
    form: Result<PageForm<RemovalForm>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(id), PageForm(form)) = (id?, form?);
    let confirm = Some(form.confirm.trim());
    match people::remove_person(&app, &caller, id, confirm).await {
        Ok(_) => Ok(done(base(&caller), "removed")),
        Err(problem) => {
            let told = Told::default();
            page_with(&app, &caller, Said::Refused(&problem), told).await
        }
    }
}
