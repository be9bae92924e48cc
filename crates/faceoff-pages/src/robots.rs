//! `/robots.txt`: rules for crawlers.

use axum::response::IntoResponse;

/// Allows public pages and the documentation; excludes personal pages and endless lists. It protects nothing: private pages
/// need a session.
const ROBOTS: &str = "User-agent: *
Disallow: /api/
Disallow: /account
Disallow: /docs/search
Disallow: /join
Disallow: /dashboard
Disallow: /organiser
Disallow: /sign-in
Allow: /
";

pub(super) async fn robots() -> impl IntoResponse {
    let headers = [
        (
            axum::http::header::CONTENT_TYPE,
            "text/plain; charset=utf-8",
        ),
        (axum::http::header::CACHE_CONTROL, "public, max-age=3600"),
    ];
    (headers, ROBOTS)
}
