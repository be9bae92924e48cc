//! `/help`: what agents find on this server: *runtimes* (language environments), the machine, and limits.

use super::frame::{Frame, PageProblem, render};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::{runtimes::RuntimesView, stage::PhaseView};
use faceoff_service::{app::App, views::runtimes};
use faceoff_types::{AgentLimits, RuntimeContent};

#[derive(Template)]
#[template(path = "help.html")]
struct Page {
    frame: Frame,
    view: RuntimesView,
    columns: Vec<LimitsColumn>,
}

/// A column of the table of limits: a stage or a tournament.
struct LimitsColumn {
    name: String,
    runtimes: String,
    limits: AgentLimits,
}

impl Page {
    /// Rows of the table of limits: name, and a value per column.
    fn rows(&self) -> Vec<(&'static str, Vec<String>)> {
        let row = |name, value: fn(&AgentLimits) -> String| {
            let values = self.columns.iter().map(|column| value(&column.limits));
            (name, values.collect())
        };
        vec![
            row("CPUs", |limits| limits.resources.cpus.to_string()),
            row("Memory, including caches and scratch files", |limits| {
                mebibytes(limits.resources.memory_bytes)
            }),
            row("Scratch files in /tmp", |limits| {
                mebibytes(limits.resources.scratch_bytes)
            }),
            row("Processes and threads", |limits| {
                limits.resources.pids.to_string()
            }),
            row("Largest file written", |limits| {
                mebibytes(limits.resources.file_size_bytes)
            }),
            row("Open files per process", |limits| {
                limits.resources.open_files.to_string()
            }),
            row("Bundle, packed", |limits| {
                mebibytes(limits.bundle.packed_bytes)
            }),
            row("Bundle, unpacked", |limits| {
                mebibytes(limits.bundle.unpacked_bytes)
            }),
            row("Time to start", |limits| {
                format!("{} s", limits.time.startup_s)
            }),
            row("Time to answer a reset", |limits| {
                format!("{} s", limits.time.reset_s)
            }),
            row("Time to answer a step, maximum", |limits| {
                format!("{} s", limits.time.step_s)
            }),
            row("Time to answer a step, mean in validation", |limits| {
                format!("{} s", limits.time.mean_s)
            }),
        ]
    }
}

fn mebibytes(bytes: u64) -> String {
    const MEBIBYTE: u64 = 1 << 20;
    if bytes.is_multiple_of(MEBIBYTE) {
        format!("{} MiB", bytes / MEBIBYTE)
    } else {
        format!("{bytes} bytes")
    }
}

pub(super) async fn page(State(app): State<App>) -> Result<Response, PageProblem> {
    let view = runtimes::build(&app).await?;
    let season = app.store.season().await?;
    let stages = view.stages.iter().map(|stage| LimitsColumn {
        name: match stage.phase {
            PhaseView::Upcoming => format!("{} (not open yet)", stage.name),
            PhaseView::Open | PhaseView::Closed => stage.name.to_string(),
        },
        runtimes: stage.runtimes.join(", "),
        limits: stage.limits.clone(),
    });
    let tournaments = view.tournaments.iter().map(|tournament| LimitsColumn {
        name: tournament.name.to_string(),
        runtimes: tournament.runtimes.join(", "),
        limits: tournament.limits.clone(),
    });
    render(&Page {
        frame: Frame::for_app(&app, season.name, "/help"),
        columns: stages.chain(tournaments).collect(),
        view,
    })
}
