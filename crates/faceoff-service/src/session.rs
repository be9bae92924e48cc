//! The session cookie, and the protection against requests from other sites (CSRF).

use crate::{
    config::HttpConfig,
    problem::{Problem, ProblemKind},
};
use axum::http::{HeaderMap, HeaderValue, header};
use faceoff_store::SESSION_LIFETIME;

const NAME: &str = "faceoff_session";

/// The session's secret from the request's cookies.
pub fn session_cookie(headers: &HeaderMap) -> Option<&str> {
    cookie_value(headers, NAME)
}

/// Value of the cookie with this name.
pub fn cookie_value<'a>(headers: &'a HeaderMap, wanted: &str) -> Option<&'a str> {
    headers
        .get_all(header::COOKIE)
        .iter()
        .filter_map(|line| line.to_str().ok())
        .flat_map(|line| line.split(';'))
        .filter_map(|pair| pair.trim().split_once('='))
        .find_map(|(name, value)| (name == wanted && !value.is_empty()).then_some(value))
}

/// Value of `Set-Cookie` that stores the session in a browser, or removes it (`None`).
///
/// # Errors
/// `Internal`: the value is not valid in a header.
pub fn set_cookie(config: &HttpConfig, session: Option<&str>) -> Result<HeaderValue, Problem> {
    let secure = secure_attribute(config);
    let (value, age) = match session {
        Some(session) => (session, SESSION_LIFETIME.as_secs()),
        None => ("", 0),
    };
    HeaderValue::try_from(format!(
        "{NAME}={value}; Path=/; HttpOnly; SameSite=Lax; Max-Age={age}{secure}"
    ))
    .map_err(Problem::internal)
}

/// The cookie attribute that restricts a cookie to TLS, if the server is reached over TLS.
pub fn secure_attribute(config: &HttpConfig) -> &'static str {
    let by_tls = config
        .public_url
        .as_deref()
        .is_some_and(|url| url.starts_with("https://"));
    if by_tls { "; Secure" } else { "" }
}

/// Refuses a request that a page of another site triggered. Browsers send the origin; a request without it is refused,
/// too, because API clients use tokens.
pub fn check_same_origin(headers: &HeaderMap) -> Result<(), Problem> {
    let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok());
    let is_own = match (text("sec-fetch-site"), text("origin")) {
        (Some(site), _) => site == "same-origin",
        (None, Some(origin)) => {
            let authority = origin.split_once("://").map(|(_, authority)| authority);
            authority.is_some() && authority == text("host")
        }
        (None, None) => false,
    };
    if is_own {
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
        let both = headers(&[("cookie", "a=b; faceoff_session=x; c=d")]);
        assert_eq!(session_cookie(&both), Some("x"));
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
        let own = [
            headers(&[("sec-fetch-site", "same-origin")]),
            headers(&[("origin", "https://a.example:1"), ("host", "a.example:1")]),
        ];
        for headers in own {
            assert!(check_same_origin(&headers).is_ok(), "{headers:?}");
        }
        let foreign = [
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
        for headers in foreign {
            assert!(check_same_origin(&headers).is_err(), "{headers:?}");
        }
    }
}
