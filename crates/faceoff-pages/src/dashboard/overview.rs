//! `/dashboard`: next evaluation, upload, submissions and latest evaluations of a team.

use super::{
    evaluations::{self, EvaluationRow},
    games::{self, TeamTournament},
    last_result::{self, LastResult},
};
use crate::{
    assets, countdown,
    dashboard_frame::{self, DashboardHeader, DoneQuery, Notice, redirect_done, render_dashboard},
    frame::{Frame, PageProblem},
    page_auth::{PageMember, PageUser},
    spoilers::Spoilers,
    submission_row::SubmissionRow,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::{IntoResponse, Redirect, Response},
};
use faceoff_api::views::me::MeView;
use faceoff_service::{
    app::App,
    extract::PageForm,
    problem::Problem,
    services::users,
    views::{me, submission},
};
use faceoff_types::EvaluationId;
use jiff::Timestamp;
use serde::Deserialize;

/// Number of submissions and evaluations in the lists. Older submissions are in a part of the page that is closed at first.
const MAX_LISTED: usize = 10;

#[derive(Template)]
#[template(path = "dashboard_overview.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    me: MeView,
    /// Style of the drawings of episodes.
    episodes_style: &'static str,
    next_cutoff: Option<String>,
    /// The time of the next cutoff, if a schedule fixes it, and how long it takes until then.
    countdown: Option<(Timestamp, String)>,
    last_result: Option<LastResult>,
    tournaments: Vec<TeamTournament>,
    active: Option<SubmissionRow>,
    /// Today's evaluation, with a sentence on what happens next.
    today: Option<(EvaluationId, String)>,
    newest: Vec<SubmissionRow>,
    older: Vec<SubmissionRow>,
    evaluations: Vec<EvaluationRow>,
    max_bundle_size: String,
    /// Version of the terms that the user has not accepted yet.
    terms_to_accept: Option<u32>,
    is_validating: bool,
}

/// The team dashboard; redirects organisers to theirs.
pub(super) async fn page(
    PageUser(caller): PageUser,
    State(app): State<App>,
    Query(notice): Query<DoneQuery>,
    spoilers: Spoilers,
) -> Result<Response, PageProblem> {
    if caller.is_organiser() {
        return Ok(Redirect::to("/organiser").into_response());
    }
    let team = faceoff_service::auth::TeamCaller::new(caller.clone())?;
    let member = PageMember { caller, team };
    page_with(&app, &member, &spoilers, Notice::Done(&notice)).await
}

/// The dashboard with a notice; also the answer to an upload or a form that was refused.
pub(super) async fn page_with(
    app: &App,
    member: &PageMember,
    spoilers: &Spoilers,
    notice: Notice<'_>,
) -> Result<Response, PageProblem> {
    let team = &member.team.team;
    let me = me::build(app, team.clone()).await?;
    let submissions = submission::team_submissions(app, team.id).await?;
    let mut newest: Vec<SubmissionRow> = submissions.iter().map(SubmissionRow::from).collect();
    let older = newest.split_off(newest.len().min(MAX_LISTED));
    let active = submissions.iter().find(|submission| submission.active);
    let terms = app.store.terms().await?;
    let newest_terms = terms.first().map(|terms| terms.version);
    let user = member.caller.user();
    let today = me.today.evaluation.zip(me.today.next.clone());
    let page = Page {
        frame: Frame::load(app, "/dashboard").await?,
        head: DashboardHeader::new(&member.caller, "/dashboard", notice),
        episodes_style: assets::EPISODES_STYLE.url(),
        countdown: me
            .next_cutoff
            .as_ref()
            .and_then(|next| next.at)
            .map(|at| (at, countdown::until(at, app.config.clock.now()))),
        last_result: last_result::of_team(app, team.id).await?,
        tournaments: games::of_team(app, team.id, spoilers.result_display()).await?,
        next_cutoff: me.next_cutoff.as_ref().map(ToString::to_string),
        active: active.map(SubmissionRow::from),
        today,
        newest,
        older,
        evaluations: evaluations::of_team(app, team.id, MAX_LISTED).await?,
        max_bundle_size: dashboard_frame::bytes(me.max_bundle_bytes),
        terms_to_accept: newest_terms
            .filter(|newest| user.is_some_and(|user| user.accepted_terms != Some(*newest))),
        is_validating: !me.validating.is_empty(),
        me,
    };
    render_dashboard(&page, notice)
}

#[derive(Deserialize)]
pub(super) struct TermsForm {
    version: u32,
}

pub(super) async fn accept_terms(
    member: PageMember,
    State(app): State<App>,
    spoilers: Spoilers,
    form: Result<PageForm<TermsForm>, Problem>,
) -> Result<Response, PageProblem> {
    let PageForm(TermsForm { version }) = form?;
    match users::accept_terms(&app, &member.caller, version).await {
        Ok(_) => Ok(redirect_done("/dashboard", "terms")),
        Err(problem) => page_with(&app, &member, &spoilers, Notice::Refused(&problem)).await,
    }
}
