//! Forms of the dashboards that are sent after the session has expired: the sign-in page keeps what was typed.

use crate::{
    kept_form::KeptForm,
    page_auth::{form_path, redirect_to_sign_in},
    sign_in,
    signed_in::SignedIn,
};
use axum::{
    extract::{FromRequest, RawForm, Request, State},
    http::{HeaderMap, StatusCode, header},
    middleware::Next,
    response::{IntoResponse, Response},
};
use faceoff_service::{app::App, session};

fn is_text_form(headers: &HeaderMap) -> bool {
    let media_type = headers.get(header::CONTENT_TYPE);
    let media_type = media_type.and_then(|value| value.to_str().ok());
    media_type.is_some_and(|value| value.starts_with("application/x-www-form-urlencoded"))
}

/// Answers a dashboard's form without a valid session with the sign-in page, which keeps the form. Forms of other sites are not kept, and
/// neither are files.
pub(super) async fn keep_form(State(app): State<App>, request: Request, next: Next) -> Response {
    let headers = request.headers();
    let path = form_path(request.uri().path()).map(str::to_owned);
    let is_keepable = !request.method().is_safe()
        && !SignedIn::is_current()
        && !headers.contains_key(header::AUTHORIZATION)
        && is_text_form(headers)
        && session::check_same_origin(headers).is_ok();
    let Some(path) = path.filter(|_| is_keepable) else {
        return next.run(request).await;
    };
    let body = match RawForm::from_request(request, &()).await {
        Ok(RawForm(body)) => body,
        Err(rejection) => return rejection.into_response(),
    };
    let fields = serde_urlencoded::from_bytes(&body).unwrap_or_default();
    match KeptForm::new(&path, fields) {
        Some(form) => match sign_in::page_with_form(&app, form).await {
            Ok(page) => (StatusCode::UNAUTHORIZED, page).into_response(),
            Err(problem) => problem.into_response(),
        },
        None => redirect_to_sign_in(&path),
    }
}
