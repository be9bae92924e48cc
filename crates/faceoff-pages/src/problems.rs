//! `/problems`: the kinds of errors. The `type` of every problem links to this page.

use super::frame::{Frame, PageProblem, render};
use askama::Template;
use axum::response::Response;
use faceoff_service::problem::ProblemKind;

#[derive(Template)]
#[template(path = "problems.html")]
struct Page {
    frame: Frame,
    kinds: &'static [ProblemKind],
}

pub(super) async fn page() -> Result<Response, PageProblem> {
    render(&Page {
        frame: Frame::without_season("/problems"),
        kinds: ProblemKind::ALL,
    })
}
