//! `/desk`: what plays next, the upload, and what the team has entered.

use super::evaluations::{self, Played};
use crate::{
    desk_frame::{self, Done, Head, Said, done, render_desk},
    entry::Entry,
    frame::{Frame, PageProblem},
    signed_in::{Member, SignedIn},
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::{IntoResponse, Redirect, Response},
};
use faceoff_api::views::me::MeView;
use faceoff_service::{
    acts::people,
    app::App,
    extract::PageForm,
    problem::Problem,
    views::{me, season::SeasonHead, submission},
};
use faceoff_types::EvaluationId;
use serde::Deserialize;

/// Submissions and evaluations that are listed at once; the rest is behind a fold.
const NEWEST: usize = 10;

#[derive(Template)]
#[template(path = "desk_agents.html")]
struct Page {
    frame: Frame,
    head: Head,
    me: MeView,
    next_cut: Option<String>,
    /// What plays at it.
    active: Option<Entry>,
    today: Option<(EvaluationId, String)>,
    newest: Vec<Entry>,
    older: Vec<Entry>,
    evaluations: Vec<Played>,
    largest: String,
    /// The version of the terms that nobody who looks has accepted.
    terms_owed: Option<u32>,
    is_validating: bool,
}

/// The desk; of an organiser, theirs.
pub(super) async fn page(
    SignedIn(caller): SignedIn,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    if caller.is_organiser() {
        return Ok(Redirect::to("/organiser").into_response());
    }
    let team = faceoff_service::auth::TeamCaller::of(caller.clone())?;
    page_with(&app, &Member { caller, team }, Said::Done(&said)).await
}

/// The desk, with what was done or refused.
pub(super) async fn page_with(
    app: &App,
    member: &Member,
    said: Said<'_>,
) -> Result<Response, PageProblem> {
    let team = &member.team.team;
    let season = SeasonHead::now(app).await?.name;
    let me = me::of(app, team.clone()).await?;
    let submissions = submission::of_team(app, team.id).await?;
    let mut entries: Vec<Entry> = submissions.iter().map(Entry::from).collect();
    let older = entries.split_off(entries.len().min(NEWEST));
    let active = submissions.iter().find(|submission| submission.active);
    let terms = app.store.terms().await.map_err(Problem::from)?;
    let newest_terms = terms.first().map(|terms| terms.version);
    let person = member.caller.person();
    let today = me.turn.evaluation.zip(me.turn.next.clone());
    let page = Page {
        frame: Frame::of(app, season, "/desk"),
        head: Head::of(&member.caller, "/desk", said),
        next_cut: me.next_cut.as_ref().map(ToString::to_string),
        active: active.map(Entry::from),
        today,
        newest: entries,
        older,
        evaluations: evaluations::of_team(app, team.id, NEWEST).await?,
        largest: desk_frame::bytes(me.max_bundle_bytes),
        terms_owed: newest_terms
            .filter(|newest| person.is_some_and(|person| person.accepted_terms != Some(*newest))),
        is_validating: !me.validating.is_empty(),
        me,
    };
    render_desk(&page, said)
}

#[derive(Deserialize)]
pub(super) struct TermsForm {
    version: u32,
}

/// The person accepts the terms.
pub(super) async fn accept_terms(
    member: Member,
    State(app): State<App>,
    form: Result<PageForm<TermsForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(TermsForm { version }) = form?;
    match people::accept_terms(&app, &member.caller, version).await {
        Ok(_) => Ok(done("/desk", "terms")),
        Err(problem) => page_with(&app, &member, Said::Refused(&problem)).await,
    }
}
