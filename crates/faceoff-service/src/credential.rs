//! The credential of a request, as it was sent: a token in the header `Authorization`, or a session's cookie.

use crate::{
    config::HttpConfig,
    problem::{Problem, ProblemKind},
    session,
};
use axum::http::{HeaderMap, HeaderValue, header, request::Parts};
use faceoff_api::{secret_extraction::extract_secret, token::hash_token};

/// The credential of a request: an API token, or the secret of a browser's session.
pub(crate) enum Credential<'a> {
    Bearer(&'a str),
    Cookie(&'a str),
}

impl<'a> Credential<'a> {
    /// The credential, if there is one; it may be invalid.
    ///
    /// # Errors
    /// `Unauthenticated`: the header has another form. `Forbidden`: a change with a cookie that a page of another site triggered.
    pub(crate) fn read(parts: &'a Parts, config: &HttpConfig) -> Result<Option<Self>, Problem> {
        if let Some(value) = parts.headers.get(header::AUTHORIZATION) {
            return match bearer_token(value) {
                Some(token) => Ok(Some(Self::Bearer(token))),
                None => Err(Problem::new(
                    ProblemKind::Unauthenticated,
                    "the header Authorization is not of the form “Bearer TOKEN”",
                )),
            };
        }
        let Some(cookie) = session::session_cookie(config, &parts.headers) else {
            return Ok(None);
        };
        // Browsers also attach cookies to requests that a page of another site triggers.
        if !parts.method.is_safe() {
            session::check_same_origin(&parts.headers)?;
        }
        Ok(Some(Self::Cookie(cookie)))
    }
}

/// Hash of the secret that a request has, valid or not.
pub(crate) fn secret_hash(config: &HttpConfig, headers: &HeaderMap) -> Option<[u8; 32]> {
    let secret = match headers.get(header::AUTHORIZATION) {
        Some(value) => bearer_token(value),
        None => session::session_cookie(config, headers),
    };
    secret.map(hash_token)
}

/// The sealed grant of a remote worker, if the request has one; it may be invalid.
pub fn sealed_grant(headers: &HeaderMap) -> Option<&str> {
    let value = headers.get(header::AUTHORIZATION)?;
    value.to_str().ok()?.strip_prefix("Grant ")
}

/// The token of a header `Authorization: Bearer TOKEN`; `None` if it has another form. Two common mistakes are accepted: a token in
/// quotation marks, and a token without the word `Bearer`.
fn bearer_token(value: &HeaderValue) -> Option<&str> {
    let text = value.to_str().ok()?.trim();
    let token = match text.split_once(' ') {
        Some((scheme, token)) if scheme.eq_ignore_ascii_case("bearer") => extract_secret(token),
        None if extract_secret(text).starts_with("fo_") => extract_secret(text),
        _ => return None,
    };
    (!token.is_empty()).then_some(token)
}
