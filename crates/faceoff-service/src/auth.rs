//! Authentication: extractors that turn a token or a session cookie into a caller. A caller is a user (organiser or team
//! member), an API client with a team's token, or the *operator* of the server, who has access to its data folder.

use crate::{
    app::{App, AppState},
    boxed_future,
    change_quota::{self, RemainingChangesSlot},
    credential::Credential,
    priority_permits::Precedence,
    problem::{Problem, ProblemKind},
    recent_callers::RecentCaller,
    request_log, session,
};
use axum::{
    extract::FromRequestParts,
    http::{HeaderMap, header, request::Parts},
};
use faceoff_api::token::hash_token;
use faceoff_store::{
    Actor, Principal, Requester, StoreError, Team, Token, TokenKind, TokenRejection, User,
    VerifiedToken,
};
use faceoff_types::TeamId;
use jiff::Timestamp;
use std::sync::Arc;
use uuid::Uuid;

/// A caller with a valid token.
#[derive(Debug, Clone)]
pub struct Caller {
    /// The token or session of the request.
    pub token: Token,
    /// Hash of the token's secret.
    secret_hash: [u8; 32],
    pub principal: Principal,
}

impl Caller {
    /// A caller whose token has been verified. `secret_hash` is the hash of its secret.
    pub const fn new(token: Token, secret_hash: [u8; 32], principal: Principal) -> Self {
        Self {
            token,
            secret_hash,
            principal,
        }
    }

    /// The caller as the event log writes it.
    pub const fn actor(&self) -> Actor {
        match &self.principal {
            Principal::Operator => Actor::Operator,
            Principal::Team(team) => Actor::Team(team.id),
            Principal::Organiser(user) | Principal::Member(user, _) => Actor::User(user.id),
        }
    }

    /// Who makes the request, for checks in the transaction of a change.
    pub fn requester(&self) -> Requester {
        Requester {
            user: self.user().map(|user| user.id),
            token: Some((self.token.id, self.secret_hash)),
        }
    }

    /// The team that the caller belongs to or acts for.
    pub const fn team(&self) -> Option<&Team> {
        match &self.principal {
            Principal::Operator | Principal::Organiser(_) => None,
            Principal::Team(team) | Principal::Member(_, team) => Some(team),
        }
    }

    /// The user; `None` for the operator and for a team's API client.
    pub const fn user(&self) -> Option<&User> {
        match &self.principal {
            Principal::Operator | Principal::Team(_) => None,
            Principal::Organiser(user) | Principal::Member(user, _) => Some(user),
        }
    }

    /// The operator, or an organiser.
    pub const fn is_organiser(&self) -> bool {
        matches!(
            self.principal,
            Principal::Operator | Principal::Organiser(_)
        )
    }

    /// The caller's priority under overload.
    pub const fn precedence(&self) -> Precedence {
        if self.is_organiser() {
            Precedence::Organiser
        } else {
            Precedence::Team
        }
    }

    /// The id of the user, or of the team whose API client it is; `None`: the operator.
    fn owner(&self) -> Option<Uuid> {
        let user = self.user().map(|user| user.id.as_uuid());
        user.or_else(|| self.team().map(|team| team.id.as_uuid()))
    }

    /// Whether the caller acts for this team or is an organiser.
    pub fn may_see(&self, team: TeamId) -> bool {
        self.is_organiser() || self.team().is_some_and(|own| own.id == team)
    }

    /// The resource, if the caller may see the `team` that it belongs to; otherwise the same error as if it did not exist.
    /// `kind` names the kind of resource in the message.
    pub fn visible<T>(
        &self,
        kind: &str,
        resource: Result<T, StoreError>,
        team: impl Fn(&T) -> TeamId,
    ) -> Result<T, Problem> {
        match resource {
            Ok(resource) if self.may_see(team(&resource)) => Ok(resource),
            Ok(_) | Err(StoreError::NotFound(_)) => Err(Problem::not_found(kind)),
            Err(error) => Err(error.into()),
        }
    }

    /// Describes the caller's token in the message of a refusal.
    fn token_description(&self) -> String {
        match &self.principal {
            Principal::Operator => "the organiser's".into(),
            Principal::Organiser(user) => format!("that of the organiser “{}”", user.name),
            Principal::Team(team) => format!("that of the team “{}”", team.name),
            Principal::Member(user, team) => {
                format!("that of “{}” of the team “{}”", user.name, team.name)
            }
        }
    }
}

/// A caller with an organiser's rights.
#[derive(Debug, Clone)]
pub struct Organiser(Caller);

impl Organiser {
    /// Who makes the request, for checks in the transaction of a change.
    pub fn requester(&self) -> Requester {
        self.0.requester()
    }

    /// # Errors
    /// `Forbidden`.
    pub fn new(caller: Caller) -> Result<Self, Problem> {
        if caller.is_organiser() {
            return Ok(Self(caller));
        }
        Err(Problem::new(
            ProblemKind::Forbidden,
            format!(
                "this request needs an organiser's token; yours is {}",
                caller.token_description()
            ),
        ))
    }

    /// The caller as the event log writes it.
    pub const fn actor(&self) -> Actor {
        self.0.actor()
    }
}

/// A caller who acts for a team: a member, or an API client with the team's token.
#[derive(Debug, Clone)]
pub struct TeamCaller {
    /// The team that the caller acts for.
    pub team: Team,
    caller: Caller,
}

impl TeamCaller {
    /// # Errors
    /// `Forbidden`.
    pub fn new(caller: Caller) -> Result<Self, Problem> {
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
                    caller.token_description()
                ),
            )),
        }
    }

    /// The caller as the event log writes it.
    pub const fn actor(&self) -> Actor {
        self.caller.actor()
    }

    /// The resource, if it belongs to the caller's team; otherwise as [`Caller::visible`].
    pub fn visible<T>(
        &self,
        kind: &str,
        resource: Result<T, StoreError>,
        team: impl Fn(&T) -> TeamId,
    ) -> Result<T, Problem> {
        self.caller.visible(kind, resource, team)
    }
}

/// The caller of a browser's session, for what every page shows of its viewer; `None` for visitors. It neither counts nor records
/// the request, since the handler of the page does.
///
/// # Errors
/// `Internal`: the database cannot be read.
#[boxed_future]
pub async fn session_caller(
    app: &AppState,
    headers: &HeaderMap,
) -> Result<Option<Caller>, Problem> {
    match session::session_cookie(&app.config, headers) {
        Some(secret) => caller_with_session(app, secret).await,
        None => Ok(None),
    }
}

/// The caller with this secret of a session; `None` if it is not valid.
///
/// # Errors
/// `Internal`: the database cannot be read.
#[boxed_future]
pub async fn caller_with_session(app: &AppState, secret: &str) -> Result<Option<Caller>, Problem> {
    let secret_hash = hash_token(secret);
    let now = app.config.clock.now();
    let verified = app
        .store
        .verify_token(secret_hash, TokenKind::Session, now)
        .await?;
    Ok(verified
        .ok()
        .map(|VerifiedToken { token, principal }| Caller::new(token, secret_hash, principal)))
}

/// Request extension: the caller of the request's session, which a layer has found already.
#[derive(Debug, Clone)]
pub struct SessionCaller(pub Caller);

#[boxed_future]
async fn authenticate(parts: &Parts, app: &App) -> Result<Option<Caller>, Problem> {
    let (token, kind) = match Credential::read(parts, &app.config)? {
        None => return Ok(None),
        Some(Credential::Bearer(token)) => (token, TokenKind::ApiToken),
        Some(Credential::Cookie(token)) => (token, TokenKind::Session),
    };
    let now = app.config.clock.now();
    // The time of a look-up by hash may depend on the hash. That is safe: a token whose hash shares a prefix with
    // another one cannot be chosen.
    let secret_hash = hash_token(token);
    let session = parts.extensions.get::<SessionCaller>();
    // The secret of a session is no API token: in the header `Authorization` it is not valid.
    let session = session
        .filter(|session| kind == TokenKind::Session && session.0.secret_hash == secret_hash);
    let verified = match session {
        Some(SessionCaller(caller)) => Ok(VerifiedToken {
            token: caller.token.clone(),
            principal: caller.principal.clone(),
        }),
        None => app.store.verify_token(secret_hash, kind, now).await?,
    };
    let VerifiedToken { token, principal } = match verified {
        Ok(verified) => verified,
        Err(rejection) => {
            app.recent_callers.remove(&secret_hash);
            return match kind {
                // With an expired session cookie the caller is a visitor.
                TokenKind::Session => Ok(None),
                TokenKind::ApiToken => Err(token_problem(rejection)),
            };
        }
    };
    app.check_rate(token.id)?;
    record_use(app, &token, now);
    let caller = Caller::new(token, secret_hash, principal);
    let recent = RecentCaller {
        precedence: caller.precedence(),
        owner: caller.owner(),
    };
    app.recent_callers.insert(secret_hash, recent);
    if let Some(team) = caller.team()
        && change_quota::is_counted(&parts.method, parts.uri.path())
    {
        let slot = parts.extensions.get::<RemainingChangesSlot>().cloned();
        let slot = slot.unwrap_or_default();
        slot.count(&app.change_quota, team.id, caller.token.id, now)?;
    }
    request_log::record_actor(&caller.actor());
    Ok(Some(caller))
}

/// Records the last use of a token in the background: the request neither waits for it nor fails with it.
fn record_use(app: &App, token: &Token, now: Timestamp) {
    let is_recent = token
        .last_used_at
        .is_some_and(|at| now.duration_since(at) < faceoff_store::LAST_USE_INTERVAL);
    if is_recent {
        return;
    }
    let (app, token) = (Arc::clone(app), token.clone());
    tokio::spawn(async move {
        if let Err(error) = app.store.record_token_use(&token, now).await {
            tracing::debug!(token = %token.id, %error, "the last use of a token was not recorded");
        }
    });
}

fn token_problem(rejection: TokenRejection) -> Problem {
    let format_time = |at: Timestamp| at.strftime("%Y-%m-%d %H:%M UTC").to_string();
    let detail = match rejection {
        TokenRejection::Unknown => {
            "the token is unknown; it may have been replaced. Create a new one, or ask an organiser for one".to_owned()
        }
        TokenRejection::WrongKind => {
            "expected an API token, got a session cookie; create a token with POST /api/v1/tokens".to_owned()
        }
        TokenRejection::Revoked(at) => format!(
            "the token was revoked or replaced, or its user's account closed, by {}. Use another one, or ask an organiser for \
             one",
            format_time(at)
        ),
        TokenRejection::Expired(at) => format!(
            "the token expired on {}. Create a new one, or ask an organiser for one",
            format_time(at)
        ),
    };
    Problem::new(ProblemKind::Unauthenticated, detail)
}

impl FromRequestParts<App> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        authenticate(parts, app).await?.ok_or_else(|| {
            Problem::new(
                ProblemKind::Unauthenticated,
                "expected a token, got none; send the header “Authorization: Bearer TOKEN” with your token, your team's, or \
                 an organiser's",
            )
        })
    }
}

/// A caller, or a visitor without a token. An invalid token is refused.
#[derive(Debug, Clone)]
pub struct OptionalCaller(pub Option<Caller>);

impl FromRequestParts<App> for OptionalCaller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        // A header with another scheme than Bearer is meant for a proxy in front of the server.
        let header = parts.headers.get(header::AUTHORIZATION);
        let scheme = header.and_then(|value| value.as_bytes().get(..7));
        if scheme.is_some_and(|scheme| !scheme.eq_ignore_ascii_case(b"bearer ")) {
            return Ok(Self(None));
        }
        authenticate(parts, app).await.map(Self)
    }
}

impl FromRequestParts<App> for Organiser {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        Self::new(Caller::from_request_parts(parts, app).await?)
    }
}

impl FromRequestParts<App> for TeamCaller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        Self::new(Caller::from_request_parts(parts, app).await?)
    }
}
