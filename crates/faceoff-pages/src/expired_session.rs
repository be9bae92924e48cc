//! Forms of the dashboards that are sent after the session has expired, or that fail by a fault of the server: a page keeps what was typed.

use crate::{
    frame::{PageProblem, ServerFault},
    kept_form::{self, KeptForm},
    page_auth::{form_path, redirect_to_sign_in},
    sign_in,
    signed_in::is_visitor,
};
use axum::{
    body::Body,
    extract::{FromRequest, RawForm, Request, State},
    http::{HeaderMap, StatusCode, header},
    middleware::Next,
    response::{IntoResponse, Response},
};
use faceoff_service::{
    app::App,
    problem::{Problem, ProblemKind},
    session, timeouts,
};
use std::time::Duration;

/// Is it a form without files?
fn is_text_form(headers: &HeaderMap) -> bool {
    let media_type = headers.get(header::CONTENT_TYPE);
    let media_type = media_type.and_then(|value| value.to_str().ok());
    media_type.is_some_and(|value| value.starts_with("application/x-www-form-urlencoded"))
}

/// A layer around the dashboards' forms. A form that is sent without a valid session is answered with the sign-in page; a form that
/// failed by a fault of the server, with a page of that problem. Both pages keep what was typed. Forms of other sites are not kept, and
/// neither are files.
pub(super) async fn keep_form(
    State((app, time_limit)): State<(App, Duration)>,
    request: Request,
    next: Next,
) -> Response {
    let headers = request.headers();
    let path = form_path(request.uri().path()).map(str::to_owned);
    let is_keepable = !request.method().is_safe()
        && !headers.contains_key(header::AUTHORIZATION)
        && is_text_form(headers)
        && session::check_same_origin(headers).is_ok();
    let Some(path) = path.filter(|_| is_keepable) else {
        return next.run(request).await;
    };
    let (parts, body) = request.into_parts();
    let request = Request::from_parts(parts.clone(), body);
    let read_form = tokio::time::timeout(time_limit, RawForm::from_request(request, &()));
    let body = match read_form.await {
        Ok(Ok(RawForm(body))) => body,
        Err(_) => return PageProblem(timeouts::problem(time_limit)).into_response(),
        Ok(Err(rejection)) => {
            let detail = format!("the form is malformed: {}", rejection.body_text());
            let problem = Problem::new(ProblemKind::InvalidRequest, detail);
            return PageProblem::from(problem).into_response();
        }
    };
    let kept_form = || {
        let fields = serde_urlencoded::from_bytes(&body).unwrap_or_default();
        KeptForm::new(&path, fields)
    };
    if is_visitor() {
        return match kept_form() {
            Some(form) => match sign_in::page_with_form(&app, form).await {
                Ok(page) => (StatusCode::UNAUTHORIZED, page).into_response(),
                Err(problem) => problem.into_response(),
            },
            None => redirect_to_sign_in(&path),
        };
    }
    let request = Request::from_parts(parts, Body::from(body.clone()));
    let response = next.run(request).await;
    let fault = match response.extensions().get::<ServerFault>() {
        Some(fault) => Some(fault.clone()),
        // A response that timed out has no such extension.
        None => (response.status() == StatusCode::SERVICE_UNAVAILABLE)
            .then(|| ServerFault::of(&timeouts::problem(time_limit))),
    };
    match fault.zip(kept_form()) {
        Some((fault, form)) => kept_form::page_after_fault(&app, form, fault, response),
        None => response,
    }
}
