//! `/desk`: what plays next, the upload, and what the team has entered.

use super::evaluations::{self, Played};
use crate::{
    acts::people,
    app::App,
    extract::PageForm,
    pages::{
        desk_frame::{self, Done, Head, done, render_desk},
        frame::{Frame, PageProblem},
        signed_in::{Member, Refused, SignedIn},
    },
    problem::Problem,
    views::{
        me::MeView,
        season::SeasonHead,
        submission::{SubmissionStatus, SubmissionView},
    },
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::{IntoResponse, Redirect, Response},
};
use faceoff_types::{EvaluationId, SubmissionId};
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

/// A submission in a list.
pub(super) struct Entry {
    pub(super) id: SubmissionId,
    pub(super) name: String,
    pub(super) file: String,
    pub(super) uploaded_at: String,
    /// In a word.
    pub(super) state: &'static str,
    /// How that is coloured, beside its word.
    pub(super) class: &'static str,
    pub(super) reason: Option<String>,
    pub(super) place: Option<String>,
    pub(super) next: String,
    pub(super) is_active: bool,
    pub(super) can_activate: bool,
    pub(super) can_withdraw: bool,
    pub(super) has_archive: bool,
}

impl From<&SubmissionView> for Entry {
    fn from(view: &SubmissionView) -> Self {
        let is_gone = view.archive_removed.is_some();
        let is_valid = matches!(view.status, SubmissionStatus::Valid { .. });
        let is_withdrawn = view.withdrawn_at.is_some();
        let (state, class, reason) = match &view.status {
            _ if view.deleted.is_some() => ("deleted", "plain", None),
            _ if is_withdrawn => ("withdrawn", "plain", None),
            SubmissionStatus::Validating => ("in its smoke run", "waiting", None),
            SubmissionStatus::Valid { .. } => ("valid", "good", None),
            SubmissionStatus::Invalid { reason, .. } => ("invalid", "bad", Some(reason.clone())),
            SubmissionStatus::ValidationError { reason } => (
                "not checked, by the server’s fault",
                "bad",
                Some(reason.clone()),
            ),
        };
        let place = view.queue.map(|queue| {
            let when = match queue.expected_at {
                Some(at) => format!("verdict expected {}", desk_frame::at(at)),
                None => "nobody can tell yet when its verdict comes".to_owned(),
            };
            format!("Number {} of {} smoke runs; {when}", queue.place, queue.of)
        });
        let named = view.label.clone().or_else(|| view.agent_name.clone());
        Self {
            id: view.id,
            name: named.unwrap_or_else(|| view.file_name.clone()),
            file: format!("{}, {}", view.file_name, desk_frame::bytes(view.bytes)),
            uploaded_at: desk_frame::at(view.created_at),
            state,
            class,
            reason,
            place,
            next: view.next.clone(),
            is_active: view.active,
            can_activate: is_valid && !is_gone && !view.active,
            can_withdraw: is_valid && !is_gone && !is_withdrawn,
            has_archive: !is_gone && !matches!(view.status, SubmissionStatus::Invalid { .. }),
        }
    }
}

/// The desk; of an organiser, theirs.
pub(super) async fn page(
    signed_in: Result<SignedIn, Refused>,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    let caller = match signed_in {
        Ok(SignedIn(caller)) if caller.is_organiser() => {
            return Ok(Redirect::to("/organiser").into_response());
        }
        Ok(SignedIn(caller)) => caller,
        Err(refused) => return Ok(refused.into_response()),
    };
    let team = crate::auth::TeamCaller::of(caller.clone())?;
    page_with(&app, &Member { caller, team }, &said, None).await
}

/// The desk, with what was done or `refused`.
pub(super) async fn page_with(
    app: &App,
    member: &Member,
    said: &Done,
    refused: Option<&Problem>,
) -> Result<Response, PageProblem> {
    let team = &member.team.team;
    let season = SeasonHead::now(app).await?.name;
    let me = MeView::of(app, team.clone()).await?;
    let submissions = SubmissionView::of_team(app, team.id).await?;
    let mut entries: Vec<Entry> = submissions.iter().map(Entry::from).collect();
    let older = entries.split_off(entries.len().min(NEWEST));
    let active = submissions.iter().find(|submission| submission.active);
    let terms = app.store.terms().await.map_err(Problem::from)?;
    let newest_terms = terms.first().map(|terms| terms.version);
    let person = member.caller.person();
    let today = me.turn.evaluation.zip(me.turn.next.clone());
    let page = Page {
        frame: Frame::of(app, season, "/desk"),
        head: Head::of(&member.caller, "/desk", said).refusing(refused),
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
    render_desk(&page, refused)
}

#[derive(Deserialize)]
pub(super) struct TermsForm {
    version: u32,
}

/// The person accepts the terms.
pub(super) async fn accept_terms(
    member: Result<Member, Refused>,
    State(app): State<App>,
    form: Result<PageForm<TermsForm>, Problem>,
) -> Result<Response, PageProblem> {
    let member = match member {
        Ok(member) => member,
        Err(refused) => return Ok(refused.into_response()),
    };
    let PageForm(TermsForm { version }) = form?;
    match people::accept_terms(&app, &member.caller, version).await {
        Ok(_) => Ok(done("/desk", "terms")),
        Err(problem) => page_with(&app, &member, &Done::default(), Some(&problem)).await,
    }
}
