//! The steps until a season runs, which the organisers' overview lists until all are done.

use faceoff_service::{app::App, problem::Problem, views::season::SeasonSummary};
use faceoff_store::StagePhase;

/// A step, with the page or the command that does it.
pub(super) struct Step {
    pub(super) is_done: bool,
    pub(super) title: &'static str,
    pub(super) detail: &'static str,
    /// Path and label of the page on which to do it.
    pub(super) link: Option<(&'static str, &'static str)>,
    /// A command that does it.
    pub(super) command: Option<&'static str>,
}

/// All steps, in order; `None` once all are done.
pub(super) async fn open_steps(app: &App) -> Result<Option<Vec<Step>>, Problem> {
    if app.store.archived_season().is_some() {
        return Ok(None);
    }
    let now = app.config.clock.now();
    let season = SeasonSummary::load(app).await?;
    let stages = app.store.stages().await?;
    let has_opened = |phase| matches!(phase, StagePhase::Open | StagePhase::Closed);
    let days = app.store.days().await?;
    let has_submission = !app.store.active_submissions().await?.is_empty();
    let steps = vec![
        Step {
            is_done: !season.name.is_empty(),
            title: "Set up the season",
            detail: "Set season.name and server.public_url in faceoff.toml and restart the server: pages show the name, and \
                     invitation links begin with the address.",
            link: Some(("/docs/configuration", "Configuration")),
            command: None,
        },
        Step {
            is_done: stages.iter().any(|stage| has_opened(stage.phase(now))),
            title: "Open a stage",
            detail: "A stage has its dates, rules and daily cutoff. Teams can be evaluated once it is open.",
            link: Some(("/organiser/stages", "Stages")),
            command: None,
        },
        Step {
            is_done: !app.store.teams().await?.is_empty(),
            title: "Invite a team",
            detail: "Create an invitation link for the first member of a team, who names it and invites the others. Or open \
                     registration.",
            link: Some(("/organiser/access#invite", "Invite")),
            command: Some("faceoff admin create-team NAME"),
        },
        Step {
            is_done: has_submission || !days.is_empty(),
            title: "Get the first valid submission",
            detail: "A member uploads a bundle on the dashboard or with the command; a validation run tests it.",
            link: Some(("/docs/start", "Your first agent")),
            command: Some("faceoff submit FOLDER"),
        },
        Step {
            is_done: !days.is_empty(),
            title: "Start the first evaluation day",
            detail: "All active submissions are evaluated. A stage with a daily cutoff starts its days automatically.",
            link: Some(("/organiser/day", "Evaluation day")),
            command: Some("faceoff admin start-day"),
        },
        Step {
            is_done: days.iter().any(|(day, _)| day.released_at.is_some()),
            title: "See the first results on the board",
            detail: "They are released when the last evaluation of the day has ended.",
            link: Some(("/", "Board")),
            command: None,
        },
    ];
    let is_open = steps.iter().any(|step| !step.is_done);
    Ok(is_open.then_some(steps))
}
