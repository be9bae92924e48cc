//! Layers around every request: unread bodies, id, log line, rate limit, cache, compression, security headers, and a handler
//! for panics.

use crate::{
    in_flight::{self, InFlight},
    peer::Peer,
    unread_body::discard_unread,
};
use axum::{
    Router,
    body::Body,
    extract::{Request, State},
    http::{Extensions, HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Version, header},
    middleware::{self, Next},
    response::{IntoResponse, Response},
};
use faceoff_api::paths::API_BASE;
use faceoff_pages::{Embeddable, StyledPicture};
use faceoff_service::{
    answer_cache,
    app::AppState,
    change_quota::RemainingChangesSlot,
    network::Network,
    problem::Problem,
    request_log::{REQUEST_ID, log_request},
    request_preconditions::RequestPreconditions,
};
use std::{any::Any, num::NonZeroU32, sync::Arc};
use tower_http::{
    catch_panic::CatchPanicLayer,
    compression::{
        CompressionLayer,
        predicate::{Predicate, SizeAbove},
    },
    request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer},
};

pub(crate) fn wrap(site: Router, app: &Arc<AppState>) -> Router {
    // The last layer is the outermost. So the id exists before the log line is written, and the response
    // to a panic or a refused request has the security headers as well.
    let compressible = SizeAbove::new(MIN_COMPRESSED_BYTES).and(is_compressible);
    site.layer(CatchPanicLayer::custom(panic_response))
        .layer(CompressionLayer::new().compress_when(compressible))
        .layer(middleware::from_fn_with_state(
            Arc::clone(app),
            serve_cached,
        ))
        .layer(middleware::from_fn(revalidate))
        .layer(middleware::from_fn_with_state(
            InFlight::new(app),
            in_flight::limit,
        ))
        .layer(middleware::from_fn_with_state(Arc::clone(app), limit_rate))
        .layer(middleware::from_fn(add_change_quota_headers))
        .layer(middleware::from_fn(share_public_api))
        .layer(middleware::map_response(security_headers))
        .layer(PropagateRequestIdLayer::new(REQUEST_ID))
        .layer(middleware::from_fn_with_state(Arc::clone(app), log_request))
        .layer(SetRequestIdLayer::new(REQUEST_ID, MakeRequestUuid))
        .layer(middleware::map_request(drop_foreign_request_id))
        .layer(middleware::from_fn_with_state(
            Arc::clone(app),
            discard_unread,
        ))
}

/// Smaller responses are not compressed, because they would gain nothing. This includes all responses with a secret, whose
/// compressed length could reveal it.
const MIN_COMPRESSED_BYTES: u64 = 2048;

/// Whether the response is text or JSON. Other responses stay as they are: archives are compressed already, event streams must
/// not be buffered, and byte ranges refer to the uncompressed file.
fn is_compressible(_: StatusCode, _: Version, headers: &HeaderMap, _: &Extensions) -> bool {
    let media_type = headers.get(header::CONTENT_TYPE);
    let media_type = media_type.and_then(|value| value.to_str().ok());
    let essence = media_type.and_then(|value| value.split(';').next());
    let media_types = [
        "application/json",
        "application/problem+json",
        "image/svg+xml",
        "text/css",
        "text/csv",
        "text/html",
        "text/javascript",
        "text/plain",
    ];
    essence.is_some_and(|essence| media_types.contains(&essence.trim()))
}

/// Answers 304 to a client that already has the current page of a board (the ranking of a stage). The condition
/// (`If-None-Match`) is removed from the request, so one cached page serves clients with and without a condition.
async fn revalidate(mut request: Request, next: Next) -> Response {
    if !answer_cache::is_board_page(request.uri().path()) {
        return next.run(request).await;
    }
    let conditions = RequestPreconditions::take_from(request.headers_mut());
    let response = next.run(request).await;
    let tag = response.headers().get(header::ETAG).cloned();
    match tag.filter(|_| response.status() == StatusCode::OK) {
        Some(tag) if conditions.matches(&tag) => {
            let (mut parts, _) = response.into_parts();
            parts.status = StatusCode::NOT_MODIFIED;
            for name in [header::CONTENT_TYPE, header::CONTENT_LENGTH] {
                parts.headers.remove(name);
            }
            Response::from_parts(parts, Body::empty())
        }
        _ => response,
    }
}

/// Answers requests that have a cache key (`answer_cache.rs`) from the cache of recent responses.
async fn serve_cached(
    State(app): State<Arc<AppState>>,
    mut request: Request,
    next: Next,
) -> Response {
    let current_second = app.config.clock.now().as_second();
    match answer_cache::cache_key(&mut request, &app.store, current_second) {
        Some(key) => answer_cache::get(&app.answer_cache, key, next.run(request)).await,
        None => next.run(request).await,
    }
}

/// Lets a page show one state of the season: all reads of its handler see the same one. A form may read what it has changed, so
/// its reads are separate.
pub(crate) async fn read_consistently(
    State(app): State<Arc<AppState>>,
    request: Request,
    next: Next,
) -> Response {
    match *request.method() {
        Method::GET | Method::HEAD => app.store.read_consistently(next.run(request)).await,
        _ => next.run(request).await,
    }
}

/// Lets scripts of other sites read the API as visitors (CORS). They cannot send a token or a cookie: browsers would ask for
/// permission first, which no route gives, and `*` does not cover requests with cookies.
async fn share_public_api(request: Request, next: Next) -> Response {
    let path = request.uri().path().strip_prefix(API_BASE);
    let is_shared = request.method().is_safe() && path.is_some_and(|path| path.starts_with('/'));
    let mut response = next.run(request).await;
    if is_shared {
        for name in [
            header::ACCESS_CONTROL_ALLOW_ORIGIN,
            header::ACCESS_CONTROL_EXPOSE_HEADERS,
        ] {
            response
                .headers_mut()
                .insert(name, HeaderValue::from_static("*"));
        }
    }
    response
}

/// Adds the headers about the team's quota of changes to the response to a change.
async fn add_change_quota_headers(mut request: Request, next: Next) -> Response {
    if request.method().is_safe() {
        return next.run(request).await;
    }
    let remaining_changes = RemainingChangesSlot::default();
    request.extensions_mut().insert(remaining_changes.clone());
    let mut response = next.run(request).await;
    remaining_changes.add_headers(response.headers_mut());
    response
}

/// How many requests a request with this path counts as in the rate limit. A search reads all of the documentation, and the
/// picture of a card (what a chat shows of a link) has to be drawn.
fn request_cost(path: &str) -> NonZeroU32 {
    const SEARCH: NonZeroU32 = NonZeroU32::new(10).unwrap();
    const CARD: NonZeroU32 = NonZeroU32::new(5).unwrap();
    match path {
        "/docs/search" => SEARCH,
        _ if path.ends_with("/card.png") => CARD,
        _ => NonZeroU32::MIN,
    }
}

/// Answers `TooManyRequests` to an address, or to a signed-in caller, that exceeds its rate limit.
async fn limit_rate(
    State(app): State<Arc<AppState>>,
    mut request: Request,
    next: Next,
) -> Response {
    let peer = request.extensions().get::<Peer>();
    let client = peer.and_then(|peer| peer.client_address(request.headers()));
    let checked = match client {
        Some(address) => {
            let cost = request_cost(request.uri().path());
            let network = Network::from_address(address);
            let source = app.request_source(request.headers(), network);
            app.request_limiter.check_source(&source, cost)
        }
        None => Ok(()),
    };
    if let Some(address) = client {
        request
            .extensions_mut()
            .insert(Network::from_address(address));
    }
    match checked {
        Ok(()) => next.run(request).await,
        Err(problem) => {
            app.config.metrics.web().record_refusal("rate");
            faceoff_pages::problem_response(request.uri().path(), request.headers(), problem)
        }
    }
}

/// Request ids are made by this server only: an id set by the client could imitate another request's log lines.
async fn drop_foreign_request_id(mut request: Request) -> Request {
    request.headers_mut().remove(REQUEST_ID);
    request
}

/// The content security policy of SVG pictures with their own styles. Some browsers apply it to pictures in pages, too.
const STYLED_PICTURE_POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'";

/// The content security policy: what a page may load, and which sites may embed it.
macro_rules! policy {
    ($ancestors:literal) => {
        concat!(
            "default-src 'none'; style-src 'self'; script-src 'self'; connect-src 'self'; img-src 'self'; \
             base-uri 'none'; form-action 'self'; frame-ancestors ",
            $ancestors
        )
    };
}

async fn security_headers(mut response: Response) -> Response {
    let is_embeddable = response.extensions().get::<Embeddable>().is_some();
    let is_styled_picture = response.extensions().get::<StyledPicture>().is_some();
    let headers = response.headers_mut();
    if !is_embeddable {
        headers.insert(header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY"));
    }
    for (name, value) in [
        (
            header::CONTENT_SECURITY_POLICY,
            match (is_styled_picture, is_embeddable) {
                (true, _) => STYLED_PICTURE_POLICY,
                (false, true) => policy!("*"),
                (false, false) => policy!("'none'"),
            },
        ),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        // With "no-referrer" browsers would also hide the origin of this server's own forms (`Origin: null`). Over plain http they say
        // nothing else about where a form comes from, so all forms would be refused as those of other sites.
        (header::REFERRER_POLICY, "same-origin"),
        (
            HeaderName::from_static("cross-origin-opener-policy"),
            "same-origin",
        ),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            match is_embeddable {
                true => "cross-origin",
                false => "same-origin",
            },
        ),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    // Scores change, and API responses belong to their caller. Only assets with a hash in their name set another value.
    headers
        .entry(header::CACHE_CONTROL)
        .or_insert(HeaderValue::from_static("no-store"));
    response
}

fn panic_response(panic: Box<dyn Any + Send + 'static>) -> Response {
    let message = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    Problem::internal(format_args!("a handler panicked: {message}")).into_response()
}
