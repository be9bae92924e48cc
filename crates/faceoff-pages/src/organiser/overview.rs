//! `/organiser`: open tasks of the organisers and the status of the season.

use super::{
    checklist::{self, Step},
    tournament,
    tournaments::decision_text,
};
use crate::{
    board_status,
    dashboard_frame::{self, DashboardHeader, DoneQuery, Notice},
    format::{self, utc_minute},
    frame::{Frame, PageProblem, render},
    page_auth::PageOrganiser,
};
use askama::Template;
use axum::{
    extract::{Query, State},
    response::Response,
};
use faceoff_api::views::{capacity::Fit, evaluation::EvaluationStatus};
use faceoff_service::{
    app::App,
    problem::Problem,
    views::{
        capacity, day, evaluation, health,
        pending_decisions::{self, TournamentDecisionKind},
        queue, stage, storage,
        visibility::Visibility,
        workers,
    },
};
use faceoff_store::{RegistrationState, Stage, StagePhase};
use faceoff_types::{StageDay, StageId, StageName};
use std::collections::BTreeSet;

#[derive(Template)]
#[template(path = "organiser_overview.html")]
struct Page {
    frame: Frame,
    head: DashboardHeader,
    /// The steps until the season runs; `None` once all are done.
    checklist: Option<Vec<Step>>,
    items: Vec<Item>,
    /// Running and queued jobs, if known.
    queue: Option<(u32, u32)>,
    slots: u32,
    teams: usize,
    stages: Vec<StageSummary>,
}

/// An open task or a problem.
struct Item {
    /// CSS class of the severity: `bad` or `waiting`.
    class: &'static str,
    title: String,
    detail: String,
    /// Pages to act on it: path and label.
    links: Vec<(String, String)>,
}

struct StageSummary {
    id: StageId,
    name: StageName,
    phase: &'static str,
    /// The latest day, the number of its evaluations that have ended, and of all.
    latest: Option<(jiff::civil::Date, u32, usize)>,
    next_cutoff: Option<String>,
}

/// A team is listed if it uses at least this share of its upload quota, in percent.
const NEARLY_FULL_PERCENT: u64 = 90;
/// Organisers see the number of wrong passwords from this number on.
const MANY_WRONG_PASSWORDS: u32 = 20;
/// Largest number of users who are named with their number of wrong passwords.
const MAX_LISTED_NAMES: usize = 5;

/// Items about the server: queue, clock, workers, passwords and storage. Returns also the number of running and of queued jobs, if known.
async fn server_items(app: &App) -> Result<(Vec<Item>, Option<(u32, u32)>), Problem> {
    let mut items = Vec::new();
    let mut queue = None;
    match health::check(app).await {
        Ok(health) => {
            queue = Some((health.running, health.waiting));
            if let Some(decision) = health.paused {
                items.push(Item {
                    class: "waiting",
                    title: "The queue is paused".to_owned(),
                    detail: format!(
                        "Since {} ({}). No new jobs start; queued jobs: {}.",
                        utc_minute(decision.at),
                        decision.reason,
                        health.waiting
                    ),
                    links: vec![("/organiser/decide/resume".into(), "Resume the queue".into())],
                });
            }
        }
        Err(problem) => items.push(Item {
            class: "bad",
            title: problem.kind().title().to_owned(),
            detail: format::sentence(problem.detail()),
            links: vec![("/organiser/storage".into(), "Storage".into())],
        }),
    }
    if let Some(step) = app.config.clock.step() {
        items.push(Item {
            class: "bad",
            title: format!("The system clock is {}", step.size()),
            detail: format::sentence(&step.to_string()),
            links: vec![(
                "/organiser/decide/accept-clock".into(),
                "Accept the clock".into(),
            )],
        });
    }
    for ban in app.store.worker_bans().await? {
        items.push(Item {
            class: "bad",
            title: format!("The worker {} is banned", ban.worker),
            detail: format!("Since {}: {}.", utc_minute(ban.at), ban.reason),
            links: vec![("/organiser/workers".into(), "Workers".into())],
        });
    }
    let workers = workers::current(app);
    for alarm in workers.alarms {
        items.push(Item {
            class: "waiting",
            title: "A job on a remote worker is taking long".to_owned(),
            detail: format!("{alarm}."),
            links: vec![("/organiser/workers".into(), "Workers".into())],
        });
    }
    for problem in workers.problems {
        items.push(Item {
            class: "bad",
            title: "Problem with remote workers".to_owned(),
            detail: format!("{problem}. The server keeps retrying."),
            links: vec![("/organiser/workers".into(), "Workers".into())],
        });
    }
    items.extend(wrong_passwords(app).await?);
    for team in storage::all(app).await? {
        if team.bundle_bytes.saturating_mul(100)
            >= team.quota_bytes.saturating_mul(NEARLY_FULL_PERCENT)
        {
            items.push(Item {
                class: "waiting",
                title: format!("{} has used up most of its storage quota", team.team_name),
                detail: format!(
                    "{} of {} used by bundles.",
                    dashboard_frame::bytes(team.bundle_bytes),
                    dashboard_frame::bytes(team.quota_bytes)
                ),
                links: vec![("/organiser/storage".into(), "Storage".into())],
            });
        }
    }
    Ok((items, queue))
}

/// An item if there were many wrong passwords in the last hour, which may be attempts to guess them.
async fn wrong_passwords(app: &App) -> Result<Option<Item>, Problem> {
    let attempts = app.passwords.wrong_passwords(app.config.clock.now());
    if attempts.total() < MANY_WRONG_PASSWORDS {
        return Ok(None);
    }
    let mut names = Vec::new();
    for (user, count) in attempts.by_user.iter().take(MAX_LISTED_NAMES) {
        names.push(format!("{count} for {}", app.store.user(*user).await?.name));
    }
    let others = attempts.by_user.iter().skip(MAX_LISTED_NAMES);
    let others: u32 = others.map(|(_, count)| count).sum();
    if others > 0 {
        names.push(format!("{others} for other users"));
    }
    if attempts.unknown_names > 0 {
        names.push(format!(
            "{} for names without a password",
            attempts.unknown_names
        ));
    }
    Ok(Some(Item {
        class: "waiting",
        title: "Many wrong passwords".to_owned(),
        detail: format!(
            "{} within about an hour: {}. After five wrong passwords for a name, sign-ins with that name have to wait. Tokens, \
             sessions and new links still work.",
            attempts.total(),
            names.join(", ")
        ),
        links: vec![("/organiser/access".into(), "Users and tokens".into())],
    }))
}

async fn registration_and_question_items(app: &App) -> Result<Vec<Item>, Problem> {
    let mut items = Vec::new();
    let registrations = app.store.registrations().await?;
    let pending = registrations
        .iter()
        .filter(|registration| registration.state == RegistrationState::Pending);
    for registration in pending {
        items.push(Item {
            class: "waiting",
            title: format!("{} has registered", registration.team_name),
            detail: format!(
                "Registered {}. Contact: {}",
                utc_minute(registration.created_at),
                registration.contact
            ),
            links: vec![
                (
                    format!("/organiser/decide/approve/{}", registration.id),
                    "Approve".into(),
                ),
                (
                    format!("/organiser/decide/refuse/{}", registration.id),
                    "Refuse".into(),
                ),
            ],
        });
    }
    let questions = app.store.questions().await?;
    let open = questions
        .iter()
        .filter(|question| question.answer.is_none())
        .count();
    if open > 0 {
        items.push(Item {
            class: "waiting",
            title: match open {
                1 => "1 open question".to_owned(),
                open => format!("{open} open questions"),
            },
            detail: "The answer goes to the team; you can also publish it.".to_owned(),
            links: vec![("/organiser/messages".into(), "Messages".into())],
        });
    }
    Ok(items)
}

async fn tournament_items(app: &App) -> Result<Vec<Item>, Problem> {
    let decisions = pending_decisions::of_tournaments(app).await?.into_iter();
    let items = decisions.map(|decision| Item {
        class: match decision.kind {
            TournamentDecisionKind::Rerun { .. } => "bad",
            TournamentDecisionKind::StartRound | TournamentDecisionKind::Close => "waiting",
        },
        detail: decision_text(decision.kind),
        title: format!("{} needs a decision", decision.name),
        links: vec![(tournament::page_path(decision.id), "Tournament".into())],
    });
    Ok(items.collect())
}

/// Evaluations of a day that failed because of a platform fault or were not played, and that have no rerun.
async fn failures(app: &App, day: StageDay) -> Result<Vec<Item>, Problem> {
    let visibility = Visibility::for_organiser(app).await?;
    let views = evaluation::day_evaluations(app, &visibility, day).await?;
    let evaluations = app.store.evaluations_of_day(day).await?;
    let to_rerun: BTreeSet<_> = pending_decisions::evaluations_to_rerun(&evaluations)
        .map(|evaluation| evaluation.id)
        .collect();
    let to_rerun = views.into_iter().filter(|view| to_rerun.contains(&view.id));
    let items = to_rerun.filter_map(|view| {
        let (outcome, reason) = match view.status {
            EvaluationStatus::PlatformFailed { reason, .. } => {
                ("failed because of a platform fault", reason)
            }
            EvaluationStatus::DeadlineMissed { reason, .. } => ("was not finished in time", reason),
            _ => return None,
        };
        Some(Item {
            class: "bad",
            title: format!("{}’s evaluation of {} {outcome}", view.team_name, view.day),
            detail: format::sentence(&reason),
            links: vec![
                (
                    format!("/organiser/decide/rerun/{}", view.id),
                    "Rerun the evaluation".into(),
                ),
                (
                    format!("/organiser/day?stage={}&day={}", day.stage, day.date),
                    "Evaluation day".into(),
                ),
            ],
        })
    });
    Ok(items.collect())
}

/// Items about a stage, and its line in the list of stages.
async fn stage_items(app: &App, stage: Stage) -> Result<(Vec<Item>, StageSummary), Problem> {
    let now = app.config.clock.now();
    let phase = stage.phase(now);
    let mut items = Vec::new();
    if phase == StagePhase::Open && app.store.archived_season().is_none() {
        for forecast in capacity::build(app, stage.id).await?.days {
            let (class, title) = match forecast.fit {
                Fit::Not => ("bad", "will not finish before its deadline"),
                Fit::Unknown => ("waiting", "may not finish before its deadline"),
                Fit::Probably | Fit::Surely => continue,
            };
            items.push(Item {
                class,
                title: format!("Evaluation day {} of {} {title}", forecast.day, stage.name),
                detail: forecast.summary,
                links: vec![(
                    format!("/organiser/stages/{}", stage.id),
                    "Stage settings".into(),
                )],
            });
        }
    }
    let is_provisional = phase == StagePhase::Closed && stage.sign_off.is_none();
    if is_provisional {
        items.push(Item {
            class: "waiting",
            title: format!("{} has closed; its result is provisional", stage.name),
            detail: "It is provisional until you sign it off.".to_owned(),
            links: vec![(format!("/organiser/stages/{}", stage.id), "Stage".into())],
        });
    }
    if phase == StagePhase::Open
        && let Some(day) = app.store.future_day(&stage, now).await?
    {
        let day = day.stage_day;
        items.push(Item {
            class: "bad",
            title: format!("Evaluation day {} of {} is in the future", day.date, stage.name),
            detail: "It was started when the clock was ahead. No other day starts until its date has passed, unless you \
                     void it."
                .to_owned(),
            links: vec![(format!("/organiser/decide/void-day/{day}"), "Void the day".into())],
        });
    }
    let latest = app
        .store
        .newest_day(stage.id)
        .await?
        .map(|day| day.stage_day);
    let mut latest_day = None;
    if let Some(latest) = latest {
        let evaluations = app.store.evaluations_of_day(latest).await?;
        let done = evaluations
            .iter()
            .filter(|evaluation| evaluation.state.is_over())
            .count();
        let done = u32::try_from(done).unwrap_or(u32::MAX);
        latest_day = Some((latest.date, done, evaluations.len()));
        if stage.sign_off.is_none() {
            items.extend(failures(app, latest).await?);
        }
    }
    let next_cutoff = day::next_cutoff(app, &stage)
        .await?
        .map(|next| next.to_string());
    let summary = StageSummary {
        id: stage.id,
        phase: board_status::phase_label(stage::phase(phase), stage.sign_off.is_some()),
        name: stage.name,
        latest: latest_day,
        next_cutoff,
    };
    Ok((items, summary))
}

pub(super) async fn page(
    user: PageOrganiser,
    State(app): State<App>,
    Query(notice): Query<DoneQuery>,
) -> Result<Response, PageProblem> {
    let (mut items, queue) = server_items(&app).await?;
    let mut stages = Vec::new();
    for stage in app.store.stages().await? {
        let (items_of_stage, summary) = stage_items(&app, stage).await?;
        items.extend(items_of_stage);
        stages.push(summary);
    }
    items.extend(registration_and_question_items(&app).await?);
    items.extend(tournament_items(&app).await?);
    // Problems first; the sort is stable.
    items.sort_by_key(|item| item.class != "bad");
    let path = "/organiser";
    let page = Page {
        frame: Frame::load(&app, path).await?,
        head: DashboardHeader::new(&user.caller, path, Notice::Done(&notice)),
        checklist: checklist::open_steps(&app).await?,
        items,
        queue,
        slots: queue::slots(&app),
        teams: app.store.teams().await?.len(),
        stages,
    };
    render(&page)
}
