//! The REST API: routes, parsing of requests, and the OpenAPI document. One file per resource. The types of responses,
//! called views, are in [`faceoff_api::views`]; [`faceoff_service::views`] builds them.

mod ablations;
mod announcements;
mod archive;
mod board;
mod board_csv;
mod board_freezes;
mod bundles;
mod calling_team;
mod capacity;
mod clip_response;
mod clips;
mod clock_acceptance;
mod comparisons;
mod datasets;
mod deprecated_routes;
mod document;
mod download_links;
mod downloads;
mod entrants;
mod episode_count;
mod evaluation_days;
mod evaluations;
mod event_reader;
mod event_stream;
mod events;
mod extra_evaluations;
mod friendly_games;
mod game_clips;
mod game_files;
mod games;
mod health;
mod invitations;
mod live_game;
mod live_reader;
mod organiser_decisions;
mod paging;
mod partial_uploads;
mod proposals;
mod ratings;
mod registrations;
mod rounds;
mod runtimes;
mod schedule_replays;
mod season;
mod season_archive;
mod served_document;
mod sessions;
mod sign_off;
mod sse;
mod stages;
mod storage;
mod stored_dataset;
mod submissions;
mod teams;
mod terms;
mod tokens;
mod tournaments;
mod upload;
mod users;
mod webhooks;
mod workers;

use axum::{Router, extract::DefaultBodyLimit, http::HeaderMap, middleware, routing::get};
use document::Document;
use faceoff_api::paths::API_BASE;
use faceoff_service::{
    api_document::ApiDocument, app::App, extract::MAX_JSON_BYTES,
    request_preconditions::RequestPreconditions, timeouts,
};
use faceoff_types::Competition;
use served_document::ServedDocument;
use std::{sync::Arc, time::Duration};
use utoipa::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

/// All routes, and the OpenAPI document. `timeout` limits the time of every response except uploads and archives.
pub fn router(timeout: Duration, competition: &Arc<Competition>) -> (Router<App>, ApiDocument) {
    let resources = OpenApiRouter::with_openapi(Document::openapi())
        .merge(season_routes())
        .merge(stage_routes())
        .merge(submission_routes())
        .merge(evaluation_routes())
        .merge(tournament_routes())
        .merge(game_routes())
        .merge(user_routes())
        .merge(deprecated_routes::router())
        .layer(middleware::from_fn_with_state(timeout, timeouts::time_out))
        .layer(DefaultBodyLimit::max(MAX_JSON_BYTES));
    // An upload may take any time as long as it progresses; `upload` itself limits its size and its pauses.
    let uploads = OpenApiRouter::new()
        .routes(routes!(upload::create_submission))
        .routes(routes!(
            partial_uploads::partial_upload,
            partial_uploads::add_part,
            partial_uploads::remove_upload
        ))
        .layer(DefaultBodyLimit::disable());
    // Archives have no time limit, because the time to make one is not known in advance.
    let archives = OpenApiRouter::new().routes(routes!(season_archive::season_archive));
    let (router, mut derived) = OpenApiRouter::new()
        .nest(API_BASE, resources.merge(uploads).merge(archives))
        .split_for_parts();
    let competition = Arc::clone(competition);
    let document = ApiDocument::new(move || {
        derived.info = Document::openapi().info;
        deprecated_routes::describe(&mut derived);
        document::complete(derived, &competition)
    });
    let served = ServedDocument::new(&document);
    let router = router.route(
        &format!("{API_BASE}/openapi.json"),
        get(
            async move |conditions: RequestPreconditions, headers: HeaderMap| {
                served.respond(&conditions, &headers)
            },
        ),
    );
    (router, document)
}

/// Routes of the season: boards, event log, status of the calling team, health.
fn season_routes() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(health::health))
        .routes(routes!(health::live))
        .routes(routes!(season::season, season::change_season))
        .routes(routes!(season::close_season))
        .routes(routes!(runtimes::runtimes))
        .routes(routes!(board::board))
        .routes(routes!(board::board_history))
        .routes(routes!(board::task_board))
        .routes(routes!(calling_team::me))
        .routes(routes!(capacity::capacity))
        .routes(routes!(events::list_events))
        .routes(routes!(event_stream::follow_events))
}

/// Routes of teams, users, tokens, webhooks, invitations, terms and announcements.
fn user_routes() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(teams::create_team, teams::list_teams))
        .routes(routes!(teams::replace_token))
        .routes(routes!(teams::team, teams::change_team))
        .routes(routes!(teams::retire_team))
        .routes(routes!(teams::return_team))
        .routes(routes!(tokens::whoami))
        .routes(routes!(tokens::list_tokens, tokens::create_token))
        .routes(routes!(tokens::revoke_token))
        .routes(routes!(tokens::rotate_token))
        .routes(routes!(webhooks::list_webhooks, webhooks::create_webhook))
        .routes(routes!(
            webhooks::webhook,
            webhooks::change_webhook,
            webhooks::remove_webhook
        ))
        .routes(routes!(webhooks::rotate_webhook))
        .routes(routes!(webhooks::test_webhook))
        .routes(routes!(webhooks::list_deliveries))
        .routes(routes!(sessions::create_session))
        .routes(routes!(sessions::end_session))
        .routes(routes!(users::list_people))
        .routes(routes!(users::change_person))
        .routes(routes!(users::remove_person))
        .routes(routes!(users::set_password))
        .routes(routes!(
            invitations::list_invitations,
            invitations::create_invitation
        ))
        .routes(routes!(invitations::accept_invitation))
        .routes(routes!(invitations::revoke_invitation))
        .routes(routes!(
            registrations::list_registrations,
            registrations::register
        ))
        .routes(routes!(registrations::approve_registration))
        .routes(routes!(registrations::refuse_registration))
        .routes(routes!(terms::list_terms, terms::publish_terms))
        .routes(routes!(terms::accept_terms))
        .routes(routes!(
            announcements::list_announcements,
            announcements::announce
        ))
        .routes(routes!(announcements::list_questions, announcements::ask))
        .routes(routes!(announcements::answer))
}

/// Routes of stages, their days, and organisers' decisions.
fn stage_routes() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(stages::list_stages, stages::create_stage))
        .routes(routes!(stages::stage, stages::change_stage))
        .routes(routes!(sign_off::start_final_day))
        .routes(routes!(sign_off::finalise_stage))
        .routes(routes!(evaluation_days::start_day))
        .routes(routes!(extra_evaluations::start_missed_day))
        .routes(routes!(extra_evaluations::grant_extra_evaluation))
        .routes(routes!(board_freezes::freeze_boards))
        .routes(routes!(board_freezes::unfreeze_boards))
        .routes(routes!(proposals::list_proposals))
        .routes(routes!(proposals::proposal))
        .routes(routes!(proposals::start_trial))
        .routes(routes!(proposals::propose))
        .routes(routes!(proposals::apply_proposal))
        .routes(routes!(proposals::drop_proposal))
        .routes(routes!(organiser_decisions::void_evaluation))
        .routes(routes!(organiser_decisions::void_day))
        .routes(routes!(organiser_decisions::disqualify_team))
        .routes(routes!(organiser_decisions::pause_queue))
        .routes(routes!(organiser_decisions::resume_queue))
        .routes(routes!(clock_acceptance::accept_clock))
        .routes(routes!(organiser_decisions::reinstate_team))
}

/// Routes of submissions, ablations, storage and workers.
fn submission_routes() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(submissions::list_submissions))
        .routes(routes!(
            submissions::submission,
            submissions::describe_submission,
            bundles::delete_submission
        ))
        .routes(routes!(bundles::download_bundle))
        .routes(routes!(bundles::link_bundle))
        .routes(routes!(storage::storage))
        .routes(routes!(workers::workers))
        .routes(routes!(workers::ban_worker))
        .routes(routes!(workers::readmit_worker))
        .routes(routes!(storage::team_storage))
        .routes(routes!(submissions::withdraw_submission))
        .routes(routes!(submissions::activate_submission))
        .routes(routes!(submissions::evaluate_submission))
        .routes(routes!(ablations::ablation, ablations::start_ablation))
        .routes(routes!(ablations::ablation_motion))
        .routes(routes!(ablations::ablation_observed))
}

/// Routes of evaluations, their datasets and episodes.
fn evaluation_routes() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(evaluations::list_evaluations))
        .routes(routes!(evaluations::evaluation))
        .routes(routes!(evaluations::cancel_evaluation))
        .routes(routes!(evaluations::rerun_evaluation))
        .routes(routes!(datasets::dataset))
        .routes(routes!(datasets::link_dataset))
        .routes(routes!(datasets::violations))
        .routes(routes!(clips::episodes))
        .routes(routes!(clips::motion))
        .routes(routes!(clips::observed))
        .routes(routes!(datasets::publish_evaluation))
        .routes(routes!(comparisons::compare))
}

/// Routes of tournaments, their rounds and ratings.
fn tournament_routes() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(
            tournaments::list_tournaments,
            tournaments::open_tournament
        ))
        .routes(routes!(
            tournaments::tournament,
            tournaments::change_tournament
        ))
        .routes(routes!(entrants::enter_teams))
        .routes(routes!(entrants::depart))
        .routes(routes!(entrants::withdraw_team))
        .routes(routes!(rounds::start_round))
        .routes(routes!(tournaments::pause_tournament))
        .routes(routes!(tournaments::resume_tournament))
        .routes(routes!(tournaments::close_tournament))
        .routes(routes!(friendly_games::request_test_games))
        .routes(routes!(friendly_games::request_friendly_game))
        .routes(routes!(friendly_games::list_uncounted_games))
        .routes(routes!(
            schedule_replays::start_replays,
            schedule_replays::cancel_replays
        ))
        .routes(routes!(schedule_replays::certainty))
        .routes(routes!(ratings::ratings))
        .routes(routes!(ratings::head_to_head))
}

/// Routes of games and their files.
fn game_routes() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(game_clips::game_motion))
        .routes(routes!(game_clips::game_observed))
        .routes(routes!(games::list_games))
        .routes(routes!(games::game, games::cancel_game))
        .routes(routes!(games::list_attempts))
        .routes(routes!(games::void_game))
        .routes(routes!(games::rerun_game))
        .routes(routes!(game_files::side))
        .routes(routes!(game_files::side_log))
        .routes(routes!(game_files::recording))
        .routes(routes!(game_files::link_side))
        .routes(routes!(game_files::link_recording))
        .routes(routes!(live_game::watch_game))
}
