//! Who is calling: extractors that turn a token, or the cookie of whoever has signed in, into a person, a team or
//! the host.

use crate::{
    app::App,
    boxed,
    problem::{Problem, ProblemKind},
    session, watched,
};
use axum::{
    extract::FromRequestParts,
    http::{header, request::Parts},
};
use faceoff_api::token::hash_token;
use faceoff_store::{Actor, Holder, Person, Refusal, StoreError, Team, Token, TokenKind, Who};
use faceoff_types::TeamId;
use jiff::Timestamp;
use std::sync::Arc;

/// A caller with a good token.
#[derive(Debug, Clone)]
pub struct Caller {
    /// What they called with.
    pub token: Token,
    pub who: Who,
}

impl Caller {
    /// As the log has them.
    pub const fn actor(&self) -> Actor {
        match &self.who {
            Who::Host => Actor::Organiser,
            Who::Team(team) => Actor::Team(team.id),
            Who::Organiser(person) | Who::Member(person, _) => Actor::Person(person.id),
        }
    }

    /// Whose team they are, or speak for.
    pub const fn team(&self) -> Option<&Team> {
        match &self.who {
            Who::Host | Who::Organiser(_) => None,
            Who::Team(team) | Who::Member(_, team) => Some(team),
        }
    }

    /// The person, unless it is the host or a team's program.
    pub const fn person(&self) -> Option<&Person> {
        match &self.who {
            Who::Host | Who::Team(_) => None,
            Who::Organiser(person) | Who::Member(person, _) => Some(person),
        }
    }

    /// The host, or an organiser.
    pub const fn is_organiser(&self) -> bool {
        matches!(self.who, Who::Host | Who::Organiser(_))
    }

    /// Is it theirs, or are they an organiser?
    pub fn may_see(&self, team: TeamId) -> bool {
        self.is_organiser() || self.team().is_some_and(|own| own.id == team)
    }

    /// What was `found`, if it is of the caller's `team`; another team's looks like none at all.
    pub fn visible<T>(
        &self,
        what: &str,
        found: Result<T, StoreError>,
        team: impl Fn(&T) -> TeamId,
    ) -> Result<T, Problem> {
        match found {
            Ok(found) if self.may_see(team(&found)) => Ok(found),
            Ok(_) | Err(StoreError::NotFound(_)) => Err(Problem::not_found(what)),
            Err(error) => Err(error.into()),
        }
    }

    /// As the log line and a refusal call them.
    fn named(&self) -> String {
        match &self.who {
            Who::Host => "the organiser's".into(),
            Who::Organiser(person) => format!("that of the organiser “{}”", person.name),
            Who::Team(team) => format!("that of the team “{}”", team.name),
            Who::Member(person, team) => {
                format!("that of “{}” of the team “{}”", person.name, team.name)
            }
        }
    }
}

/// A caller who may organise.
#[derive(Debug, Clone)]
pub struct Organiser(Caller);

impl Organiser {
    /// # Errors
    /// `Forbidden`.
    pub fn of(caller: Caller) -> Result<Self, Problem> {
        if caller.is_organiser() {
            return Ok(Self(caller));
        }
        Err(Problem::new(
            ProblemKind::Forbidden,
            format!(
                "this request needs the organiser's token; yours is {}",
                caller.named()
            ),
        ))
    }

    /// As the log has them.
    pub const fn actor(&self) -> Actor {
        self.0.actor()
    }
}

/// A caller who speaks for a team: a member, or a program with the team's own token.
#[derive(Debug, Clone)]
pub struct TeamCaller {
    /// The team that they speak for.
    pub team: Team,
    caller: Caller,
}

impl TeamCaller {
    /// # Errors
    /// `Forbidden`.
    pub fn of(caller: Caller) -> Result<Self, Problem> {
        match caller.team() {
            Some(team) => Ok(Self {
                team: team.clone(),
                caller,
            }),
            None => Err(Problem::new(
                ProblemKind::Forbidden,
                format!(
                    "this request needs a team's token; yours is {}. Use the token that POST /api/v1/teams \
                     returned, or a member's",
                    caller.named()
                ),
            )),
        }
    }

    /// As the log has them.
    pub const fn actor(&self) -> Actor {
        self.caller.actor()
    }

    /// What was `found`, if it is the team's.
    pub fn visible<T>(
        &self,
        what: &str,
        found: Result<T, StoreError>,
        team: impl Fn(&T) -> TeamId,
    ) -> Result<T, Problem> {
        self.caller.visible(what, found, team)
    }
}

/// What came with the request, if anything.
enum Presented<'a> {
    Bearer(&'a str),
    Cookie(&'a str),
}

fn presented<'a>(parts: &'a Parts) -> Result<Option<Presented<'a>>, Problem> {
    if let Some(value) = parts.headers.get(header::AUTHORIZATION) {
        return match value.to_str().ok().and_then(|value| value.split_once(' ')) {
            Some((scheme, token))
                if scheme.eq_ignore_ascii_case("bearer") && !token.trim().is_empty() =>
            {
                Ok(Some(Presented::Bearer(token.trim())))
            }
            _ => Err(Problem::new(
                ProblemKind::Unauthenticated,
                "the header Authorization is not of the form “Bearer TOKEN”",
            )),
        };
    }
    let Some(cookie) = session::cookie(&parts.headers) else {
        return Ok(None);
    };
    // A cookie comes with whatever a foreign page makes the browser send.
    if !parts.method.is_safe() {
        session::check_own_page(&parts.headers)?;
    }
    Ok(Some(Presented::Cookie(cookie)))
}

#[boxed]
async fn caller(parts: &Parts, app: &App) -> Result<Option<Caller>, Problem> {
    let (token, kind) = match presented(parts)? {
        None => return Ok(None),
        Some(Presented::Bearer(token)) => (token, TokenKind::Key),
        Some(Presented::Cookie(token)) => (token, TokenKind::Session),
    };
    let now = app.config.clock.now();
    // A look-up by hash is safe although its time may depend on the hash: nobody can choose a
    // token whose hash begins as another's does.
    let holder = app.store.holder(hash_token(token), kind, now).await?;
    let Holder { token, who } = match holder {
        Ok(holder) => holder,
        // Who was signed in once is a visitor, with a cookie that says nothing.
        Err(_) if kind == TokenKind::Session => return Ok(None),
        Err(refusal) => return Err(refused(refusal)),
    };
    app.check_rate(token.id)?;
    note_use(app, &token, now);
    let caller = Caller { token, who };
    watched::asked_by(&caller.actor());
    Ok(Some(caller))
}

/// Beside the request, which does not wait for it and does not fail with it.
fn note_use(app: &App, token: &Token, now: Timestamp) {
    let is_noted = token
        .last_used_at
        .is_some_and(|at| now.duration_since(at) < faceoff_store::LAST_USE);
    if is_noted {
        return;
    }
    let (app, token) = (Arc::clone(app), token.clone());
    tokio::spawn(async move {
        if let Err(error) = app.store.token_used(&token, now).await {
            tracing::debug!(token = %token.id, %error, "the last use of a token is not noted");
        }
    });
}

fn refused(refusal: Refusal) -> Problem {
    let shown = |at: Timestamp| at.strftime("%Y-%m-%d %H:%M UTC").to_string();
    let detail = match refusal {
        Refusal::Unknown => {
            "the token is not known; it may have been replaced. Make a new one, or ask the organiser for one".to_owned()
        }
        Refusal::WrongKind => {
            "what came as a token is the cookie of a page; make a token with POST /api/v1/tokens".to_owned()
        }
        Refusal::Revoked(at) => format!(
            "the token was revoked or replaced, or its person has left, by {}. Use another one, or ask the organiser for one",
            shown(at)
        ),
        Refusal::Expired(at) => format!(
            "the token expired on {}. Make a new one, or ask the organiser for one",
            shown(at)
        ),
    };
    Problem::new(ProblemKind::Unauthenticated, detail)
}

impl FromRequestParts<App> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        caller(parts, app).await?.ok_or_else(|| {
            Problem::new(
                ProblemKind::Unauthenticated,
                "no token came; send the header “Authorization: Bearer TOKEN” with your token, your team's, or the \
                 organiser's",
            )
        })
    }
}

/// Whoever calls: also a visitor without a token. A token that is worth nothing is refused all the same.
#[derive(Debug, Clone)]
pub struct Anybody(pub Option<Caller>);

impl FromRequestParts<App> for Anybody {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        // Another scheme is somebody else's business: a proxy's in front of the pages.
        let header = parts.headers.get(header::AUTHORIZATION);
        let scheme = header.and_then(|value| value.as_bytes().get(..7));
        if scheme.is_some_and(|scheme| !scheme.eq_ignore_ascii_case(b"bearer ")) {
            return Ok(Self(None));
        }
        caller(parts, app).await.map(Self)
    }
}

impl FromRequestParts<App> for Organiser {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        Self::of(Caller::from_request_parts(parts, app).await?)
    }
}

impl FromRequestParts<App> for TeamCaller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        Self::of(Caller::from_request_parts(parts, app).await?)
    }
}
