//! The cookie of a browser's session, and the protection against requests that pages of other sites trigger (CSRF).

use crate::{
    config::HttpConfig,
    problem::{Problem, ProblemKind},
};
use axum::http::{HeaderMap, HeaderValue, header};
use faceoff_store::SESSION_LIFETIME;

/// Name of the session cookie.
const COOKIE_NAME: &str = "faceoff_session";

/// The session's secret from the request's cookies.
pub fn session_cookie(headers: &HeaderMap) -> Option<&str> {
    cookie_value(headers, COOKIE_NAME)
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
    let secure = secure_attribute(config);
    let (value, max_age_s) = match session {
        Some(session) => (session, SESSION_LIFETIME.as_secs()),
        None => ("", 0),
    };
    HeaderValue::try_from(format!(
        "{COOKIE_NAME}={value}; Path=/; HttpOnly; SameSite=Lax; Max-Age={max_age_s}{secure}"
    ))
    .map_err(Problem::internal)
}

/// The cookie attribute that restricts a cookie to TLS, if the server is reached over TLS.
pub fn secure_attribute(config: &HttpConfig) -> &'static str {
    let uses_tls = config
        .public_url
        .as_deref()
        .is_some_and(|url| url.starts_with("https://"));
    if uses_tls { "; Secure" } else { "" }
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
        assert_eq!(session_cookie(&cookies), Some("x"));
        assert_eq!(
            session_cookie(&headers(&[("cookie", "faceoff_session=")])),
            None
        );
        assert_eq!(
            session_cookie(&headers(&[("cookie", "other_faceoff_session=x")])),
            None
        );
        assert_eq!(session_cookie(&HeaderMap::new()), None);
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
