//! `/organiser`: what needs somebody first, then how the season stands.

use crate::{
    desk_frame::{self, Done, Head, Said},
    figures::minute,
    frame::{Frame, PageProblem, render},
    signed_in::Organising,
    standing,
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
        capacity, day, evaluation, health, queue, season::SeasonHead, sight::Sight, stage, storage,
        workers,
    },
};
use faceoff_store::{RegistrationState, Stage, StagePhase};
use faceoff_types::{StageDay, StageId, StageName};
use std::collections::BTreeSet;

#[derive(Template)]
#[template(path = "organiser_attention.html")]
struct Page {
    frame: Frame,
    head: Head,
    season: String,
    items: Vec<Item>,
    /// Units of work under way and waiting, where the queue tells.
    queue: Option<(u32, u32)>,
    slots: u32,
    teams: usize,
    stages: Vec<Standing>,
}

/// Something that needs somebody.
struct Item {
    /// How grave it is, beside its words.
    class: &'static str,
    title: String,
    detail: String,
    /// Where something can be done about it.
    links: Vec<(String, String)>,
}

/// A stage at a glance.
struct Standing {
    id: StageId,
    name: StageName,
    phase: &'static str,
    newest: Option<(jiff::civil::Date, u32, usize)>,
    next_cut: Option<String>,
}

/// Archives of a team that take this much of their quota are told of, in percent.
const NEARLY_FULL: u64 = 90;

async fn of_server(app: &App) -> Result<(Vec<Item>, Option<(u32, u32)>), Problem> {
    let mut items = Vec::new();
    let mut queue = None;
    match health::now(app).await {
        Ok(health) => {
            queue = Some((health.running, health.waiting));
            if let Some(ruling) = health.paused {
                items.push(Item {
                    class: "waiting",
                    title: "The queue is paused".to_owned(),
                    detail: format!(
                        "Since {} ({}). Nothing new is begun; units of work that wait: {}.",
                        minute(ruling.at),
                        ruling.reason,
                        health.waiting
                    ),
                    links: vec![("/organiser/decide/resume".into(), "Let it go on".into())],
                });
            }
        }
        Err(problem) => items.push(Item {
            class: "bad",
            title: problem.kind().title().to_owned(),
            detail: format!("{}.", problem.detail()),
            links: vec![("/organiser/storage".into(), "Storage".into())],
        }),
    }
    for ban in app.store.worker_bans().await? {
        items.push(Item {
            class: "bad",
            title: format!("The worker {} is banned", ban.worker),
            detail: format!("Since {}: {}.", minute(ban.at), ban.reason),
            links: vec![("/organiser/workers".into(), "Workers".into())],
        });
    }
    let workers = workers::now(app);
    for alarm in workers.alarms {
        items.push(Item {
            class: "waiting",
            title: "Something takes long on another machine".to_owned(),
            detail: format!("{alarm}."),
            links: vec![("/organiser/workers".into(), "Workers".into())],
        });
    }
    for trouble in workers.troubles {
        items.push(Item {
            class: "bad",
            title: "Work on other machines is in trouble".to_owned(),
            detail: format!("{trouble}. It is tried again until it can."),
            links: vec![("/organiser/workers".into(), "Workers".into())],
        });
    }
    for team in storage::all(app).await? {
        if team.archive_bytes.saturating_mul(100) >= team.quota_bytes.saturating_mul(NEARLY_FULL) {
            items.push(Item {
                class: "waiting",
                title: format!("{} has little room left for uploads", team.team_name),
                detail: format!(
                    "{} of {} of archives are kept.",
                    desk_frame::bytes(team.archive_bytes),
                    desk_frame::bytes(team.quota_bytes)
                ),
                links: vec![("/organiser/storage".into(), "Storage".into())],
            });
        }
    }
    Ok((items, queue))
}

async fn of_people(app: &App) -> Result<Vec<Item>, Problem> {
    let mut items = Vec::new();
    let registrations = app.store.registrations().await?;
    let waiting = registrations
        .iter()
        .filter(|one| one.state == RegistrationState::Waiting);
    for one in waiting {
        items.push(Item {
            class: "waiting",
            title: format!("{} wants to take part", one.team_name),
            detail: format!("Registered {}. {}", minute(one.created_at), one.contact),
            links: vec![
                (
                    format!("/organiser/decide/approve/{}", one.id),
                    "Approve".into(),
                ),
                (
                    format!("/organiser/decide/refuse/{}", one.id),
                    "Refuse".into(),
                ),
            ],
        });
    }
    let questions = app.store.questions().await?;
    let open = questions.iter().filter(|one| one.answer.is_none()).count();
    if open > 0 {
        items.push(Item {
            class: "waiting",
            title: match open {
                1 => "A team’s question waits for an answer".to_owned(),
                open => format!("{open} questions of teams wait for an answer"),
            },
            detail: "Its team reads the answer; everybody does, if you want that.".to_owned(),
            links: vec![("/organiser/messages".into(), "Messages".into())],
        });
    }
    Ok(items)
}

/// What of a stage's newest days failed by our fault, or was not played, and is not played again.
async fn failures(app: &App, of: StageDay) -> Result<Vec<Item>, Problem> {
    let sight = Sight::of_organiser(app).await?;
    let views = evaluation::of_day(app, &sight, of).await?;
    let replaced: BTreeSet<_> = views.iter().filter_map(|one| one.rerun_of).collect();
    let open = views
        .into_iter()
        .filter(|one| one.voided.is_none() && !replaced.contains(&one.id));
    let items = open.filter_map(|one| {
        let (what, reason) = match one.status {
            EvaluationStatus::PlatformFailed { reason, .. } => {
                ("failed by the server’s fault", reason)
            }
            EvaluationStatus::NotPlayed { reason, .. } => ("was not played in time", reason),
            _ => return None,
        };
        Some(Item {
            class: "bad",
            title: format!("{}’s evaluation of {} {what}", one.team_name, one.day),
            detail: format!("{reason}."),
            links: vec![
                (
                    format!("/organiser/decide/rerun/{}", one.id),
                    "Play it again".into(),
                ),
                (
                    format!("/organiser/day?stage={}&day={}", of.stage, of.date),
                    "The day".into(),
                ),
            ],
        })
    });
    Ok(items.collect())
}

async fn of_stage(app: &App, stage: Stage) -> Result<(Vec<Item>, Standing), Problem> {
    let now = app.config.clock.now();
    let phase = stage.phase(now);
    let mut items = Vec::new();
    if phase == StagePhase::Open && app.store.archived().is_none() {
        for load in capacity::of(app, stage.id).await?.days {
            let (class, title) = match load.fit {
                Fit::Not => ("bad", "does not fit into its time"),
                Fit::Unknown => ("waiting", "may not fit into its time"),
                Fit::Probably | Fit::Surely => continue,
            };
            items.push(Item {
                class,
                title: format!("The day {} of {} {title}", load.day, stage.name),
                detail: load.summary,
                links: vec![(
                    format!("/organiser/stages/{}", stage.id),
                    "Settings of the stage".into(),
                )],
            });
        }
    }
    let is_provisional = phase == StagePhase::Closed && stage.finalised.is_none();
    if is_provisional {
        items.push(Item {
            class: "waiting",
            title: format!("{} has closed, and its result is provisional", stage.name),
            detail: "Nobody may rely on it before it is signed off.".to_owned(),
            links: vec![(
                format!("/organiser/stages/{}", stage.id),
                "The stage".into(),
            )],
        });
    }
    let newest = app.store.newest_day(stage.id).await?.map(|day| day.of);
    let mut newest_day = None;
    if let Some(of) = newest {
        let evaluations = app.store.evaluations_of_day(of).await?;
        let over = evaluations.iter().filter(|one| one.state.is_over()).count();
        let over = u32::try_from(over).unwrap_or(u32::MAX);
        newest_day = Some((of.date, over, evaluations.len()));
        if stage.finalised.is_none() {
            items.extend(failures(app, of).await?);
        }
    }
    let next_cut = day::next_cut(app, &stage)
        .await?
        .map(|next| next.to_string());
    let standing = Standing {
        id: stage.id,
        phase: standing::phase(stage::phase(phase), stage.finalised.is_some()),
        name: stage.name,
        newest: newest_day,
        next_cut,
    };
    Ok((items, standing))
}

pub(super) async fn page(
    organising: Organising,
    State(app): State<App>,
    Query(said): Query<Done>,
) -> Result<Response, PageProblem> {
    let (mut items, queue) = of_server(&app).await?;
    let mut stages = Vec::new();
    for stage in app.store.stages().await.map_err(Problem::from)? {
        let (of_stage, standing) = of_stage(&app, stage).await?;
        items.extend(of_stage);
        stages.push(standing);
    }
    items.extend(of_people(&app).await?);
    // The gravest first, and otherwise as they came.
    items.sort_by_key(|item| item.class != "bad");
    let season = SeasonHead::now(&app).await?.name;
    let path = "/organiser";
    let page = Page {
        frame: Frame::of(&app, season.clone(), path),
        head: Head::of(&organising.caller, path, Said::Done(&said)),
        season,
        items,
        queue,
        slots: queue::slots(&app),
        teams: app.store.teams().await.map_err(Problem::from)?.len(),
        stages,
    };
    render(&page)
}
