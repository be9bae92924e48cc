//! The cookie of whoever has signed in, and how a request of our own pages is told from a foreign page's.

use crate::{
    config::HttpConfig,
    problem::{Problem, ProblemKind},
};
use axum::http::{HeaderMap, HeaderValue, header};
use faceoff_store::SESSION;

const NAME: &str = "faceoff_session";

/// The session's secret, if one came.
pub fn cookie(headers: &HeaderMap) -> Option<&str> {
    named(headers, NAME)
}

/// A cookie's value, if one of that name came.
pub fn named<'a>(headers: &'a HeaderMap, wanted: &str) -> Option<&'a str> {
    headers
        .get_all(header::COOKIE)
        .iter()
        .filter_map(|line| line.to_str().ok())
        .flat_map(|line| line.split(';'))
        .filter_map(|pair| pair.trim().split_once('='))
        .find_map(|(name, value)| (name == wanted && !value.is_empty()).then_some(value))
}

/// The header that makes a browser keep the session, or forget it (`None`).
///
/// # Errors
/// Our fault: the value is no header's.
pub fn set_cookie(config: &HttpConfig, session: Option<&str>) -> Result<HeaderValue, Problem> {
    let secure = secure(config);
    let (value, age) = match session {
        Some(session) => (session, SESSION.as_secs()),
        None => ("", 0),
    };
    HeaderValue::try_from(format!(
        "{NAME}={value}; Path=/; HttpOnly; SameSite=Lax; Max-Age={age}{secure}"
    ))
    .map_err(Problem::internal)
}

/// What a cookie says beside: over TLS it is sent over nothing else.
pub fn secure(config: &HttpConfig) -> &'static str {
    let by_tls = config
        .public_url
        .as_deref()
        .is_some_and(|url| url.starts_with("https://"));
    if by_tls { "; Secure" } else { "" }
}

/// Refuses what a foreign page made a browser send. Browsers say where a request comes from; what says nothing is
/// refused, too: programs send tokens.
pub fn check_own_page(headers: &HeaderMap) -> Result<(), Problem> {
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
        "the request comes with a cookie, or from a form, and not from a page of this server; sign in here, or send \
         a token in the header Authorization",
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
    fn the_session_is_found_among_other_cookies() {
        let both = headers(&[("cookie", "a=b; faceoff_session=x; c=d")]);
        assert_eq!(cookie(&both), Some("x"));
        assert_eq!(cookie(&headers(&[("cookie", "faceoff_session=")])), None);
        assert_eq!(
            cookie(&headers(&[("cookie", "other_faceoff_session=x")])),
            None
        );
        assert_eq!(cookie(&HeaderMap::new()), None);
    }

    #[test]
    fn a_foreign_page_is_told_from_ours() {
        let own = [
            headers(&[("sec-fetch-site", "same-origin")]),
            headers(&[("origin", "https://a.example:1"), ("host", "a.example:1")]),
        ];
        for headers in own {
            assert!(check_own_page(&headers).is_ok(), "{headers:?}");
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
            assert!(check_own_page(&headers).is_err(), "{headers:?}");
        }
    }
}
