//! Links that stand in for a token for a time, and for one file: made by whoever may download it, for whom has none.
//!
//! What a link opens is decided when it is followed, for whoever made it: it is good as long as the token that made it
//! is, and shows what that one would see then. Its signature is keyed with the hash of that token, so that another
//! secret of the token ends its links, too, and with a key of the server's own, which is in no backup: whoever reads the
//! database can forge none.

use axum::{
    Json,
    extract::{FromRequestParts, OriginalUri},
    http::{StatusCode, request::Parts},
};
use faceoff_api::{requests::NewLink, views::link::LinkView};
use faceoff_service::{
    app::{App, AppState},
    auth::Caller,
    extract::QueryParams,
    problem::{Problem, ProblemKind},
    watched,
};
use faceoff_store::{Holder, Refusal, StoreError};
use faceoff_types::TokenId;
use jiff::{SignedDuration, Timestamp};
use serde::Deserialize;
use utoipa::IntoParams;

/// For how long a link is good, unless its maker says another time.
const GOOD_FOR_S: u32 = 60 * 60;
const MOST_S: u32 = 7 * 24 * 60 * 60;
/// Nothing else is signed with a key of this context.
const CONTEXT: &str = "faceoff 2026-11-23 links that download a file";

/// What a link says in its query.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub(crate) struct LinkQuery {
    /// Of a link: until when it is good, in seconds since 1970.
    expires: Option<i64>,
    /// Of a link: the token that made it.
    by: Option<TokenId>,
    /// Of a link: 64 hexadecimal digits.
    signature: Option<String>,
}

/// Whoever follows a link, as who made it; else who calls, as `E` has it.
#[derive(Debug)]
pub(crate) struct LinkOr<E>(pub(crate) E);

impl<E> FromRequestParts<App> for LinkOr<E>
where
    E: FromRequestParts<App, Rejection = Problem> + From<Caller>,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        let QueryParams(query) = QueryParams::from_request_parts(parts, app).await?;
        let (expires, by, signature) = match query {
            LinkQuery {
                expires: None,
                by: None,
                signature: None,
            } => return E::from_request_parts(parts, app).await.map(Self),
            LinkQuery {
                expires: Some(expires),
                by: Some(by),
                signature: Some(signature),
            } => (expires, by, signature),
            _ => {
                return Err(Problem::new(
                    ProblemKind::InvalidRequest,
                    "a link has “expires”, “by” and “signature”, and some of these are missing; follow it as it was given",
                ));
            }
        };
        let uri = OriginalUri::from_request_parts(parts, app).await;
        let path = match &uri {
            Ok(uri) => uri.path(),
            Err(never) => match *never {},
        };
        let maker = maker(app, path, expires, by, &signature).await?;
        Ok(Self(maker.into()))
    }
}

/// Signs `path` for a caller, who may download what is there now.
///
/// # Errors
/// `InvalidContent` if it should be good for too long, or not at all.
pub(crate) async fn link(
    app: &AppState,
    caller: &Caller,
    path: &str,
    wanted: NewLink,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    let for_s = wanted.expires_in_s.unwrap_or(GOOD_FOR_S);
    if !(1..=MOST_S).contains(&for_s) {
        let detail = format!("expected 1 to {MOST_S} seconds (7 days), got {for_s}");
        return Err(Problem::invalid("expires_in_s", detail));
    }
    let until = app.config.clock.now().as_second() + i64::from(for_s);
    let expires_at = Timestamp::from_second(until).map_err(Problem::internal)?;
    let by = caller.token.id;
    let signature = sign(app, &app.store.token_hash(by).await?, path, until, by);
    let base = app.config.public_url.as_deref().unwrap_or_default();
    let url = format!("{base}{path}?expires={until}&by={by}&signature={signature}");
    tracing::info!(path, %expires_at, actor = %caller.actor(), "a link was made");
    Ok((StatusCode::CREATED, Json(LinkView { url, expires_at })))
}

fn sign(
    app: &AppState,
    token_hash: &[u8; 32],
    path: &str,
    until: i64,
    by: TokenId,
) -> blake3::Hash {
    let key = blake3::derive_key(CONTEXT, app.config.link_key.bytes());
    blake3::Hasher::new_keyed(&key)
        .update(token_hash)
        .update(&until.to_le_bytes())
        .update(by.as_uuid().as_bytes())
        .update(path.as_bytes())
        .finalize()
}

/// Who made a link that is followed now.
async fn maker(
    app: &AppState,
    path: &str,
    until: i64,
    by: TokenId,
    signature: &str,
) -> Result<Caller, Problem> {
    let not_ours = || {
        Problem::new(
            ProblemKind::LinkInvalid,
            "the link is none that was made for this file, or the token that made it has another secret by now; follow it \
             as it was given, or ask for another one",
        )
    };
    let token_hash = match app.store.token_hash(by).await {
        Ok(hash) => hash,
        Err(StoreError::NotFound(_)) => return Err(not_ours()),
        Err(error) => return Err(error.into()),
    };
    let signature = blake3::Hash::from_hex(signature).map_err(|_| not_ours())?;
    // Hashes are compared in a time that tells nothing of where they differ.
    if signature != sign(app, &token_hash, path, until, by) {
        return Err(not_ours());
    }
    let now = app.config.clock.now();
    if now.duration_since(Timestamp::UNIX_EPOCH) >= SignedDuration::from_secs(until) {
        let at = Timestamp::from_second(until).map_err(|_| not_ours())?;
        let shown = at.strftime("%Y-%m-%d %H:%M:%S UTC");
        return Err(Problem::new(
            ProblemKind::LinkExpired,
            format!("the link was good until {shown}; ask who gave it to you for another one"),
        )
        .with("expired_at", at.to_string()));
    }
    match app.store.holder_of(by, now).await? {
        Ok(Holder { token, who }) => {
            app.check_rate(token.id)?;
            let maker = Caller { token, who };
            watched::asked_by(&maker.actor());
            Ok(maker)
        }
        Err(Refusal::Revoked(_) | Refusal::Expired(_) | Refusal::Unknown | Refusal::WrongKind) => {
            Err(Problem::new(
                ProblemKind::LinkInvalid,
                "the token that made the link was revoked or has expired, and its links with it; ask for another one",
            ))
        }
    }
}
