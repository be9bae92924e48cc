//! `/robots.txt`: what those who walk the web may read.

use axum::response::IntoResponse;

/// Pages and documentation; not what belongs to one person, and no lists without an end. It hides nothing: what is not for
/// everybody asks who is there.
const ROBOTS: &str = "User-agent: *
Disallow: /api/
Disallow: /account
Disallow: /docs/search
Disallow: /join
Disallow: /desk
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
