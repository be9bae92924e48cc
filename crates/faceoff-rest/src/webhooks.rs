//! Webhooks: URLs of a team, or of the organisers, to which the server delivers events. A webhook is *dead* once the server
//! has stopped its deliveries because of failures.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests,
    views::webhook::{DeliveryView, NewWebhookView, WebhookView},
};
use faceoff_notify::{NoticeFilter, WebhookSecret, message};
use faceoff_service::{
    app::App,
    auth::Caller,
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    text,
    views::webhook,
};
use faceoff_store::{NewWebhook, Principal, StoreError, Webhook, WebhookChange};
use faceoff_types::WebhookId;
use serde_json::json;

/// Longest name of a webhook, in characters.
const MAX_NAME_CHARS: usize = 80;
/// Deliveries that a list shows at most.
const MAX_DELIVERIES: u32 = 200;

/// Whether the caller may see a webhook: organisers all, others their team's.
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

/// Refuses a team's token: if it leaked, webhooks created with it would outlive it.
fn check_not_team_token(caller: &Caller) -> Result<(), Problem> {
    match caller.principal {
        Principal::Operator | Principal::Organiser(_) | Principal::Member(..) => Ok(()),
        Principal::Team(_) => Err(Problem::new(
            ProblemKind::Forbidden,
            "a team's token cannot create or change webhooks; use a member's token, or an organiser's",
        )),
    }
}

/// A webhook that the caller may change.
async fn find_changeable(app: &App, caller: &Caller, id: WebhookId) -> Result<Webhook, Problem> {
    let webhook = find(app, caller, id).await?;
    check_not_team_token(caller)?;
    Ok(webhook)
}

fn checked_url(app: &App, url: &str) -> Result<String, Problem> {
    let url = app.config.webhooks.check_url(url.trim());
    url.map(String::from)
        .map_err(|detail| Problem::invalid("url", detail))
}

/// Checks the filter of a webhook, and returns its words in their normal form.
fn checked_filter(about: &[String]) -> Result<Vec<String>, Problem> {
    let filter = NoticeFilter::parse(about).map_err(|error| Problem::invalid("about", error))?;
    Ok(filter.to_words())
}

/// Lists the webhooks of the caller's team, oldest first; organisers see all.
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
        views.map(|webhook| webhook::view(webhook, now)).collect(),
    ))
}

/// Creates a webhook of the caller's team or of the organisers. Its secret is returned only once. Events from now on
/// are delivered.
#[utoipa::path(
    post, path = "/webhooks", tag = "people", security(("team" = []), ("organiser" = [])),
    request_body = requests::NewWebhook,
    responses(
        (status = 201, body = NewWebhookView),
        (status = 403, description = "a team's token cannot create webhooks"),
        (status = 409, description = "the owner has as many webhooks as allowed"),
        (status = 422, description = "the URL is not allowed, or `about` contains an unknown filter"),
    )
)]
pub(crate) async fn create_webhook(
    caller: Caller,
    State(app): State<App>,
    Body(request): Body<requests::NewWebhook>,
) -> Result<(StatusCode, Json<NewWebhookView>), Problem> {
    check_not_team_token(&caller)?;
    let secret = WebhookSecret::generate().map_err(Problem::internal)?;
    let new_webhook = NewWebhook {
        team: caller.team().map(|team| team.id),
        name: text::single_line("name", &request.name, MAX_NAME_CHARS)?,
        url: checked_url(&app, &request.url)?,
        topics: checked_filter(&request.about)?,
        secret: secret.bytes(),
        requester: caller.requester(),
    };
    let now = app.config.clock.now();
    let webhook = app
        .store
        .create_webhook(caller.actor(), new_webhook, now)
        .await?;
    tracing::info!(webhook = %webhook.id, actor = %caller.actor(), "webhook created");
    let view = NewWebhookView {
        webhook: webhook::view(webhook, now),
        secret: secret.encoded(),
    };
    Ok((StatusCode::CREATED, Json(view)))
}

/// Returns a webhook.
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
    Ok(Json(webhook::view(webhook, app.config.clock.now())))
}

/// Changes a webhook. A dead one can be reactivated, and then receives events from now on.
#[utoipa::path(
    patch, path = "/webhooks/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)), request_body = requests::WebhookChanges,
    responses(
        (status = 200, body = WebhookView),
        (status = 403, description = "a team's token cannot change webhooks"),
        (status = 404),
        (status = 422, description = "the URL is not allowed, or `about` contains an unknown filter"),
    )
)]
pub(crate) async fn change_webhook(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<WebhookId>,
    Body(changes): Body<requests::WebhookChanges>,
) -> Result<Json<WebhookView>, Problem> {
    let webhook = find_changeable(&app, &caller, id).await?;
    let name = changes.name.as_deref();
    let url = changes.url.as_deref();
    // Only the team may change the URL of its webhook: another receiver would get messages signed with the team's secret.
    if url.is_some() && webhook.team != caller.team().map(|team| team.id) {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            "only a member of the team can change the address of its webhook; you can remove it (DELETE \
             /api/v1/webhooks/ID)",
        ));
    }
    let change = WebhookChange {
        name: name
            .map(|name| text::single_line("name", name, MAX_NAME_CHARS))
            .transpose()?,
        url: url.map(|url| checked_url(&app, url)).transpose()?,
        topics: changes.about.as_deref().map(checked_filter).transpose()?,
        enable: changes.state.is_some(),
        requester: caller.requester(),
    };
    let now = app.config.clock.now();
    let webhook = app
        .store
        .change_webhook(caller.actor(), id, change, now)
        .await?;
    Ok(Json(webhook::view(webhook, now)))
}

/// Removes a webhook. Deliveries stop at once.
#[utoipa::path(
    delete, path = "/webhooks/{id}", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)),
    responses(
        (status = 204),
        (status = 403, description = "a team's token cannot remove webhooks"),
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

/// Replaces a webhook's secret; the new one is returned only once. For a day, deliveries are signed with both.
#[utoipa::path(
    post, path = "/webhooks/{id}/rotate", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)),
    responses(
        (status = 200, body = NewWebhookView),
        (status = 403, description = "the webhook belongs to a team, and the caller is not a member"),
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
            "only a member of the team can rotate the secret of its webhook; you can remove it (DELETE \
             /api/v1/webhooks/ID)",
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
        webhook: webhook::view(webhook, now),
        secret: secret.encoded(),
    }))
}

/// Sends a test delivery of the kind `test` to a webhook. Its outcome is listed among the deliveries.
#[utoipa::path(
    post, path = "/webhooks/{id}/test", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = WebhookId, Path)),
    responses(
        (status = 202, body = DeliveryView, description = "the delivery is queued"),
        (status = 403, description = "a team's token cannot test webhooks"),
        (status = 404),
        (status = 409, description = "the webhook is dead, or a test is already pending"),
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

/// Lists a webhook's deliveries of the last two weeks, newest first, 200 at most.
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
    let deliveries = app.store.deliveries(id, MAX_DELIVERIES).await?;
    Ok(Json(
        deliveries.into_iter().map(webhook::delivery).collect(),
    ))
}
