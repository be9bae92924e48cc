//! The cookie of a browser's session, and the protection against requests that pages of other sites trigger (CSRF).

use crate::{
    config::HttpConfig,
    problem::{Problem, ProblemKind},
};
use axum::http::{HeaderMap, HeaderValue, header};
use faceoff_store::SESSION_LIFETIME;

/// Name of the session cookie of a server without TLS.
const COOKIE_NAME: &str = "faceoff_session";
/// Name of the session cookie over TLS. Browsers accept a name with this prefix only from this host itself, over TLS and for all
/// paths. So no other host of the domain, and no one on the way, can put a session of their own in its place.
const TLS_COOKIE_NAME: &str = "__Host-faceoff_session";

/// The session's secret from the request's cookies.
pub fn session_cookie<'a>(config: &HttpConfig, headers: &'a HeaderMap) -> Option<&'a str> {
    cookie_value(headers, cookie_name(config))
}

fn cookie_name(config: &HttpConfig) -> &'static str {
    if uses_tls(config) {
        TLS_COOKIE_NAME
    } else {
        COOKIE_NAME
    }
}

/// Value of the cookie with this name; `None` if it is missing or empty.
pub fn cookie_value<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    headers
        .get_all(header::COOKIE)
        .iter()
        .filter_map(|line| line.to_str().ok())
        .flat_map(|line| line.split(';'))
        .filter_map(|pair| pair.trim().split_once('='))
        .find_map(|(key, value)| (key == name && !value.is_empty()).then_some(value))
}

/// Value of `Set-Cookie` that stores the session in a browser, or removes it (`None`).
///
/// # Errors
/// `Internal`: the value is not valid in a header.
pub fn set_cookie(config: &HttpConfig, session: Option<&str>) -> Result<HeaderValue, Problem> {
    let (name, secure) = (cookie_name(config), secure_attribute(config));
    let (value, max_age_s) = match session {
        Some(session) => (session, SESSION_LIFETIME.as_secs()),
        None => ("", 0),
    };
    HeaderValue::try_from(format!(
        "{name}={value}; Path=/; HttpOnly; SameSite=Lax; Max-Age={max_age_s}{secure}"
    ))
    .map_err(Problem::internal)
}

/// The cookie attribute that restricts a cookie to TLS, if the server is reached over TLS.
pub fn secure_attribute(config: &HttpConfig) -> &'static str {
    if uses_tls(config) { "; Secure" } else { "" }
}

/// Whether browsers reach the server over TLS.
fn uses_tls(config: &HttpConfig) -> bool {
    let public_url = config.public_url.as_deref();
    public_url.is_some_and(|url| url.starts_with("https://"))
}

/// Refuses a sign-in from which the browser would not keep the cookie: over plain http, if the server is reached over https. The user
/// would be asked to sign in again and again.
///
/// # Errors
/// `Forbidden`, with the address at which the page at `path` works.
pub fn check_cookie_is_kept(
    config: &HttpConfig,
    headers: &HeaderMap,
    path: &str,
) -> Result<(), Problem> {
    let Some(public_url) = config.public_url.as_deref().filter(|_| uses_tls(config)) else {
        return Ok(());
    };
    let origin = headers.get(header::ORIGIN);
    let origin = origin.and_then(|value| value.to_str().ok());
    let host = origin.and_then(|origin| origin.strip_prefix("http://"));
    // Browsers trust the loopback without TLS.
    let is_loopback = |host: &str| {
        host.starts_with("localhost") || host.starts_with("127.") || host.starts_with("[::1]")
    };
    if host.is_none_or(is_loopback) {
        return Ok(());
    }
    Err(Problem::new(
        ProblemKind::Forbidden,
        format!(
            "browsers keep a session of this server over https only: open this page at {public_url}{path}"
        ),
    ))
}

/// A link of a server without a public address, completed with the address at which the browser has this page. Forms send it.
pub fn absolute_link(headers: &HeaderMap, link: String) -> String {
    let origin = headers.get(header::ORIGIN);
    let origin = origin.and_then(|value| value.to_str().ok());
    match origin.filter(|origin| origin.starts_with("http")) {
        Some(origin) if link.starts_with('/') => format!("{origin}{link}"),
        _ => link,
    }
}

/// Refuses a request that a page of another site triggered. Browsers name the requesting site in a header. A request without
/// this header is refused, too: it comes from an API client, and these use tokens.
pub fn check_same_origin(headers: &HeaderMap) -> Result<(), Problem> {
    let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok());
    let is_same_origin = match (text("sec-fetch-site"), text("origin")) {
        (Some(site), _) => site == "same-origin",
        (None, Some(origin)) => {
            let authority = origin.split_once("://").map(|(_, authority)| authority);
            authority.is_some() && authority == text("host")
        }
        (None, None) => false,
    };
    if is_same_origin {
        return Ok(());
    }
    Err(Problem::new(
        ProblemKind::Forbidden,
        "expected a request from a page of this server, got one with a cookie or a form from elsewhere; sign in here, or \
         send a token in the header Authorization",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(lines: &[(&'static str, &'static str)]) -> HeaderMap {
        lines
            .iter()
            .map(|(name, value)| (name.parse().unwrap(), HeaderValue::from_static(value)))
            .collect()
    }

    #[test]
    fn session_is_found_among_other_cookies() {
        let cookies = headers(&[("cookie", "a=b; faceoff_session=x; c=d")]);
        assert_eq!(cookie_value(&cookies, COOKIE_NAME), Some("x"));
        for without_session in [
            headers(&[("cookie", "faceoff_session=")]),
            headers(&[("cookie", "other_faceoff_session=x")]),
            HeaderMap::new(),
        ] {
            assert_eq!(cookie_value(&without_session, COOKIE_NAME), None);
        }
    }

    #[test]
    fn cross_site_request_is_refused() {
        let same_origin = [
            headers(&[("sec-fetch-site", "same-origin")]),
            headers(&[("origin", "https://a.example:1"), ("host", "a.example:1")]),
        ];
        for headers in same_origin {
            assert!(check_same_origin(&headers).is_ok(), "{headers:?}");
        }
        let cross_site = [
            HeaderMap::new(),
            headers(&[("sec-fetch-site", "cross-site")]),
            headers(&[("sec-fetch-site", "same-site")]),
            headers(&[("sec-fetch-site", "none")]),
            headers(&[("origin", "https://b.example"), ("host", "a.example")]),
            headers(&[("origin", "null"), ("host", "null")]),
            headers(&[
                ("sec-fetch-site", "cross-site"),
                ("origin", "http://a"),
                ("host", "a"),
            ]),
        ];
        for headers in cross_site {
            assert!(check_same_origin(&headers).is_err(), "{headers:?}");
        }
    }
}
