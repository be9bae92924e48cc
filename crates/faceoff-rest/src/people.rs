//! People: who they are, their passwords, and how they leave.

use crate::paging::{Page, PageQuery, Paged};
use axum::{Json, extract::State};
use faceoff_api::{
    requests::{Confirmation, NewPassword},
    views::person::PersonView,
};
use faceoff_service::{
    acts::people,
    app::App,
    auth::Caller,
    extract::{Json as Body, PathParam},
    problem::{Problem, ProblemKind},
    views::person,
};
use faceoff_types::PersonId;

/// The people whom the caller may see: an organiser everybody, a team its members.
#[utoipa::path(
    get, path = "/people", tag = "people", security(("team" = []), ("organiser" = [])),
    params(PageQuery),
    responses((status = 200, body = Vec<PersonView>))
)]
pub(crate) async fn list_people(
    caller: Caller,
    page: Page<PersonId>,
    State(app): State<App>,
) -> Result<Paged<PersonView>, Problem> {
    let people = people::people(&app, &caller).await?;
    let page = page.cut(people, |person| person.id)?;
    Ok(page.map(person::of))
}

/// Lets a person do nothing any more, at once: their tokens and sessions are revoked. By an organiser, or by
/// themselves.
#[utoipa::path(
    post, path = "/people/{id}/remove", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = PersonId, Path)), request_body = Confirmation,
    responses(
        (status = 200, body = PersonView),
        (status = 403), (status = 404),
        (status = 409, description = "not confirmed with the person's name (nothing is done), gone, or the last who can organise"),
    )
)]
pub(crate) async fn remove_person(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<PersonId>,
    Body(Confirmation { confirm }): Body<Confirmation>,
) -> Result<Json<PersonView>, Problem> {
    let removed = people::remove_person(&app, &caller, id, confirm.as_deref()).await?;
    Ok(Json(person::of(removed)))
}

/// Sets the caller's password. All their other tokens and sessions are revoked.
#[utoipa::path(
    put, path = "/people/{id}/password", tag = "people", security(("team" = []), ("organiser" = [])),
    params(("id" = PersonId, Path)), request_body = NewPassword,
    responses(
        (status = 200, body = PersonView),
        (status = 403, description = "of another person, or the old one is wrong"),
        (status = 404), (status = 422), (status = 429, description = "too many wrong ones"),
    )
)]
pub(crate) async fn set_password(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<PersonId>,
    Body(new): Body<NewPassword>,
) -> Result<Json<PersonView>, Problem> {
    let person = people::find(&app, &caller, id).await?;
    if caller.person().is_none_or(|own| own.id != id) {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            format!(
                "a password is set by its person alone; make a link for “{}” instead (POST /api/v1/invitations with \
                 the role “return”)",
                person.name
            ),
        ));
    }
    let now = app.config.clock.now();
    let known = app.store.password_of(person.name.as_str()).await?;
    if known.is_some() {
        let old = new.old.unwrap_or_default();
        let matches = app.passwords.verify(known, old, now).await?;
        if matches != Some(id) {
            return Err(Problem::new(
                ProblemKind::Forbidden,
                "old: expected the password that there is; nothing was changed",
            ));
        }
    }
    let hash = app.passwords.hash(new.password).await?;
    let person = app
        .store
        .set_password(caller.actor(), id, &hash, caller.token.id, now)
        .await?;
    tracing::info!(person = %id, "password set");
    Ok(Json(person::of(person)))
}
