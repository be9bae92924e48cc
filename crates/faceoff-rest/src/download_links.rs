//! Signed links, which download one file (a bundle, dataset or recording) without a token for a limited time.
//!
//! Permissions are checked when a link is used, as for its creator: the link is valid as long as the creator's token is, and
//! gives the access that the creator has at that time. The signature includes the hash of the token, so rotating the token
//! invalidates its links. The signature's key is a secret of the server that is in no backup, so a copy of the database
//! alone is not enough to forge links.

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
    request_log,
};
use faceoff_store::{StoreError, TokenRejection, VerifiedToken};
use faceoff_types::TokenId;
use jiff::{SignedDuration, Timestamp};
use serde::Deserialize;
use utoipa::IntoParams;

/// Default validity of a link.
const DEFAULT_VALIDITY_S: u32 = 60 * 60;
/// Maximum validity of a link.
const MAX_VALIDITY_S: u32 = 7 * 24 * 60 * 60;
/// Context string with which BLAKE3 derives the signature's key; used for nothing else. Its date must not change.
const KEY_DERIVATION_CONTEXT: &str = "faceoff 2026-11-23 links that download a file";

/// Query parameters of a signed link.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub(crate) struct LinkQuery {
    /// When the signed link expires, in seconds since 1970. Only in signed links.
    expires: Option<i64>,
    /// Id of the token of the signed link's creator. Only in signed links.
    by: Option<TokenId>,
    /// Signature of the link, 64 hexadecimal digits. Only in signed links.
    signature: Option<String>,
}

/// The creator of the signed link in the request, or, without a link, the caller as `E` extracts it.
#[derive(Debug)]
pub(crate) struct LinkOr<E>(pub(crate) E);

impl<E> FromRequestParts<App> for LinkOr<E>
where
    E: FromRequestParts<App, Rejection = Problem> + From<Caller>,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Problem> {
        let QueryParams(query) = QueryParams::from_request_parts(parts, app).await?;
        let (expires_s, creator_token, signature) = match query {
            LinkQuery {
                expires: None,
                by: None,
                signature: None,
            } => return E::from_request_parts(parts, app).await.map(Self),
            LinkQuery {
                expires: Some(expires_s),
                by: Some(creator_token),
                signature: Some(signature),
            } => (expires_s, creator_token, signature),
            _ => {
                return Err(Problem::new(
                    ProblemKind::InvalidRequest,
                    "expected “expires”, “by” and “signature”, got only some of them; use the complete link unchanged",
                ));
            }
        };
        let uri = OriginalUri::from_request_parts(parts, app).await;
        let path = match &uri {
            Ok(uri) => uri.path(),
            Err(never) => match *never {},
        };
        let creator = verify(app, path, expires_s, creator_token, &signature).await?;
        Ok(Self(creator.into()))
    }
}

/// Creates a link to `path` for a caller who may download it now.
///
/// # Errors
/// `InvalidContent` if the requested validity is 0 or too long.
pub(crate) async fn link(
    app: &AppState,
    caller: &Caller,
    path: &str,
    request: NewLink,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    let validity_s = request.expires_in_s.unwrap_or(DEFAULT_VALIDITY_S);
    if !(1..=MAX_VALIDITY_S).contains(&validity_s) {
        let detail = format!("expected 1 to {MAX_VALIDITY_S} seconds (7 days), got {validity_s}");
        return Err(Problem::invalid("expires_in_s", detail));
    }
    let expires_s = app.config.clock.now().as_second() + i64::from(validity_s);
    let expires_at = Timestamp::from_second(expires_s).map_err(Problem::internal)?;
    let creator_token = caller.token.id;
    let token_hash = app.store.token_hash(creator_token).await?;
    let signature = sign(app, &token_hash, path, expires_s, creator_token);
    let base_url = app.config.public_url.as_deref().unwrap_or_default();
    let url =
        format!("{base_url}{path}?expires={expires_s}&by={creator_token}&signature={signature}");
    tracing::info!(path, %expires_at, actor = %caller.actor(), "download link created");
    Ok((StatusCode::CREATED, Json(LinkView { url, expires_at })))
}

/// The signature of a link to `path` that expires at `expires_s`, in seconds since 1970.
fn sign(
    app: &AppState,
    token_hash: &[u8; 32],
    path: &str,
    expires_s: i64,
    creator_token: TokenId,
) -> blake3::Hash {
    let key = blake3::derive_key(KEY_DERIVATION_CONTEXT, app.config.link_key.bytes());
    blake3::Hasher::new_keyed(&key)
        .update(token_hash)
        .update(&expires_s.to_le_bytes())
        .update(creator_token.as_uuid().as_bytes())
        .update(path.as_bytes())
        .finalize()
}

/// Verifies a link and returns its creator.
async fn verify(
    app: &AppState,
    path: &str,
    expires_s: i64,
    creator_token: TokenId,
    signature: &str,
) -> Result<Caller, Problem> {
    let invalid = || {
        Problem::new(
            ProblemKind::LinkInvalid,
            "the link is not valid for this file, or its creator's token was rotated; use the complete link unchanged, or \
             ask for a new one",
        )
    };
    let token_hash = match app.store.token_hash(creator_token).await {
        Ok(hash) => hash,
        Err(StoreError::NotFound(_)) => return Err(invalid()),
        Err(error) => return Err(error.into()),
    };
    let signature = blake3::Hash::from_hex(signature).map_err(|_| invalid())?;
    // `blake3::Hash` compares in constant time.
    if signature != sign(app, &token_hash, path, expires_s, creator_token) {
        return Err(invalid());
    }
    let now = app.config.clock.now();
    if now.duration_since(Timestamp::UNIX_EPOCH) >= SignedDuration::from_secs(expires_s) {
        let expired_at = Timestamp::from_second(expires_s).map_err(|_| invalid())?;
        let time = expired_at.strftime("%Y-%m-%d %H:%M:%S UTC");
        return Err(Problem::new(
            ProblemKind::LinkExpired,
            format!("the link expired at {time}; ask the person who gave it to you for a new one"),
        )
        .with("expired_at", expired_at.to_string()));
    }
    match app.store.verify_token_id(creator_token, now).await? {
        Ok(VerifiedToken { token, principal }) => {
            app.check_rate(token.id)?;
            let creator = Caller::new(token, token_hash, principal);
            request_log::record_actor(&creator.actor());
            Ok(creator)
        }
        Err(
            TokenRejection::Revoked(_)
            | TokenRejection::Expired(_)
            | TokenRejection::Unknown
            | TokenRejection::WrongKind,
        ) => Err(Problem::new(
            ProblemKind::LinkInvalid,
            "the token of the link's creator was revoked or has expired, and its links with it; ask for a new one",
        )),
    }
}
