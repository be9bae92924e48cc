//! Webhooks: programs of a team, or of the organisers, that are told of what happens.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests,
    views::webhook::{DeliveryView, NewWebhookView, WebhookView},
};
use faceoff_notify::{About, WebhookSecret, message};
use faceoff_service::{
    app::App,
    auth::Caller,
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    text,
    views::webhook,
};
use faceoff_store::{NewWebhook, StoreError, Webhook, WebhookChange, Who};
use faceoff_types::WebhookId;
use serde_json::json;

/// Longest name of a webhook.
const NAME_CHARS: usize = 80;
/// Deliveries that are shown.
const SHOWN: u32 = 200;

/// Whose webhooks a caller sees: an organiser all, others their team's.
fn may_see(caller: &Caller, webhook: &Webhook) -> bool {
    caller.is_organiser() || webhook.team.is_some_and(|team| caller.may_see(team))
}

async fn find(app: &App, caller: &Caller, id: WebhookId) -> Result<Webhook, Problem> {
    match app.store.webhook(id).await {
        Ok(webhook) if may_see(caller, &webhook) => Ok(webhook),
        Ok(_) | Err(StoreError::NotFound(_)) => Err(Problem::not_found("webhook")),
        Err(error) => Err(error.into()),
    }
}

/// Whoever finds a team's token must not have everything told to an address that outlives it.
fn check_person(caller: &Caller) -> Result<(), Problem> {
    match caller.who {
        Who::Host | Who::Organiser(_) | Who::Member(..) => Ok(()),
        Who::Team(_) => Err(Problem::new(
            ProblemKind::Forbidden,
            "a team's own token makes and changes no webhooks; a member does, or an organiser",
        )),
    }
}

/// What may be changed by the caller.
async fn find_changeable(app: &App, caller: &Caller, id: WebhookId) -> Result<Webhook, Problem> {
    let webhook = find(app, caller, id).await?;
    check_person(caller)?;
    Ok(webhook)
}

fn checked_url(app: &App, url: &str) -> Result<String, Problem> {
    let url = app.config.webhooks.check_url(url.trim());
    url.map(String::from)
        .map_err(|detail| Problem::invalid("url", detail))
}

fn checked_about(about: &[String]) -> Result<Vec<String>, Problem> {
    let about = About::of(about).map_err(|error| Problem::invalid("about", error))?;
    Ok(about.words())
}

/// The webhooks of the caller's team, the oldest first; an organiser's are all of them.
#[utoipa::path(
    get, path = "/webhooks", tag = "people", security(("team" = []), ("organiser" = [])),
    responses((status = 200, body = Vec<WebhookView>))
)]
pub(crate) async fn list_webhooks(
    caller: Caller,
    State(app): State<App>,
) -> Result<Json<Vec<WebhookView>>, Problem> {
    let now = app.config.clock.now();
    let mut webhooks = app.store.webhooks().await?;
    webhooks.retain(|webhook| may_see(&caller, webhook));
    let views = webhooks.into_iter();
    Ok(Json(
        views.map(|webhook| webhook::of(webhook, now)).collect(),
    ))
}

/// Makes a webhook, of the caller's team or of the organisers, and returns its secret, once. It is told of what happens
/// from now on.
#[utoipa::path(
    post, path = "/webhooks", tag = "people", security(("team" = []), ("organiser" = [])),
    request_body = requests::NewWebhook,
    responses(
        (status = 201, body = NewWebhookView),
        (status = 403, description = "a team's own token makes none"),
        (status = 409, description = "there are as many as there may be"),
        (status = 422, description = "the URL may not be told anything, or `about` names nothing that there is"),
    )
)]
pub(crate) async fn create_webhook(
    caller: Caller,
    State(app): State<App>,
    Body(new): Body<requests::NewWebhook>,
) -> Result<(StatusCode, Json<NewWebhookView>), Problem> {
    check_person(&caller)?;
    let secret = WebhookSecret::generate().map_err(Problem::internal)?;
    let new = NewWebhook {
        team: caller.team().map(|team| team.id),
        name: text::line("name", &new.name, NAME_CHARS)?,
        url: checked_url(&app, &new.url)?,
        about: checked_about(&new.about)?,
        secret: secret.bytes(),
    };
    let now = app.config.clock.now();
    let webhook = app.store.create_webhook(caller.actor(), new, now).await?;
    tracing::info!(webhook = %webhook.id, actor = %caller.actor(), "webhook created");
    let view = NewWebhookView {
        webhook: webhook::of(webhook, now),
        secret: secret.shown(),
    };
    Ok((StatusCode::CREATED, Json(view)))
}

/// A webhook.
#[utoipa::path(
    get, path = "/webhooks/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)),
    responses((status = 200, body = WebhookView), (status = 404))
)]
pub(crate) async fn webhook(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<WebhookId>,
) -> Result<Json<WebhookView>, Problem> {
    let webhook = find(&app, &caller, id).await?;
    Ok(Json(webhook::of(webhook, app.config.clock.now())))
}

/// Changes a webhook; one that is dead is told again, of what happens from now on.
#[utoipa::path(
    patch, path = "/webhooks/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)), request_body = requests::WebhookChanges,
    responses(
        (status = 200, body = WebhookView),
        (status = 403, description = "a team's own token changes none"),
        (status = 404),
        (status = 422, description = "the URL may not be told anything, or `about` names nothing that there is"),
    )
)]
pub(crate) async fn change_webhook(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<WebhookId>,
    Body(changes): Body<requests::WebhookChanges>,
) -> Result<Json<WebhookView>, Problem> {
    let before = find_changeable(&app, &caller, id).await?;
    let name = changes.name.as_deref();
    let url = changes.url.as_deref();
    // An address that a team has its secret for must not lead what it is told to somebody else.
    if url.is_some() && before.team != caller.team().map(|team| team.id) {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "where a team's webhook is says a member of the team; you can remove it (DELETE /api/v1/webhooks/ID)",
        ));
    }
    let change = WebhookChange {
        name: name
            .map(|name| text::line("name", name, NAME_CHARS))
            .transpose()?,
        url: url.map(|url| checked_url(&app, url)).transpose()?,
        about: changes.about.as_deref().map(checked_about).transpose()?,
        revived: changes.state.is_some(),
    };
    let now = app.config.clock.now();
    let webhook = app
        .store
        .change_webhook(caller.actor(), id, change, now)
        .await?;
    Ok(Json(webhook::of(webhook, now)))
}

/// Removes a webhook: nothing is sent there any more.
#[utoipa::path(
    delete, path = "/webhooks/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)),
    responses(
        (status = 204),
        (status = 403, description = "a team's own token removes none"),
        (status = 404),
    )
)]
pub(crate) async fn remove_webhook(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<WebhookId>,
) -> Result<StatusCode, Problem> {
    find_changeable(&app, &caller, id).await?;
    let now = app.config.clock.now();
    app.store.remove_webhook(caller.actor(), id, now).await?;
    tracing::info!(webhook = %id, actor = %caller.actor(), "webhook removed");
    Ok(StatusCode::NO_CONTENT)
}

/// Gives a webhook another secret and returns it, once. For a day what is sent is signed by both.
#[utoipa::path(
    post, path = "/webhooks/{id}/rotate", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)),
    responses(
        (status = 200, body = NewWebhookView),
        (status = 403, description = "it is a team's, and the caller is no member"),
        (status = 404),
    )
)]
pub(crate) async fn rotate_webhook(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<WebhookId>,
) -> Result<Json<NewWebhookView>, Problem> {
    let webhook = find_changeable(&app, &caller, id).await?;
    if webhook.team != caller.team().map(|team| team.id) {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "the secret of a team's webhook is for its members alone; you can remove it (DELETE /api/v1/webhooks/ID)",
        ));
    }
    let secret = WebhookSecret::generate().map_err(Problem::internal)?;
    let (actor, now) = (caller.actor(), app.config.clock.now());
    let webhook = app
        .store
        .rotate_webhook(actor, id, secret.bytes(), now)
        .await?;
    tracing::info!(webhook = %id, actor = %caller.actor(), "webhook rotated");
    Ok(Json(NewWebhookView {
        webhook: webhook::of(webhook, now),
        secret: secret.shown(),
    }))
}

/// Tells a webhook something that has not happened, of the type `test`; what comes of it is among its deliveries.
#[utoipa::path(
    post, path = "/webhooks/{id}/test", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)),
    responses(
        (status = 202, body = DeliveryView, description = "it is sent in a moment"),
        (status = 403, description = "a team's own token tests none"),
        (status = 404),
        (status = 409, description = "it is dead, or a test waits already"),
    )
)]
pub(crate) async fn test_webhook(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<WebhookId>,
) -> Result<(StatusCode, Json<DeliveryView>), Problem> {
    let webhook = find_changeable(&app, &caller, id).await?;
    let now = app.config.clock.now();
    let data = json!({ "webhook": webhook.id, "name": webhook.name });
    let body = message("test", now, &data);
    let delivery = app.store.test_webhook(id, "test", &body, now).await?;
    Ok((StatusCode::ACCEPTED, Json(webhook::delivery(delivery))))
}

/// What a webhook was told, or is about to be, the newest first: the last 200, for two weeks.
#[utoipa::path(
    get, path = "/webhooks/{id}/deliveries", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)),
    responses((status = 200, body = Vec<DeliveryView>), (status = 404))
)]
pub(crate) async fn list_deliveries(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<WebhookId>,
) -> Result<Json<Vec<DeliveryView>>, Problem> {
    find(&app, &caller, id).await?;
    let deliveries = app.store.deliveries(id, SHOWN).await?;
    Ok(Json(
        deliveries.into_iter().map(webhook::delivery).collect(),
    ))
}
