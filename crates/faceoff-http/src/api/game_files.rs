//! The files of games: each side's own at once, both sides' when they are published, and what agents wrote.

use super::downloads::download;
use crate::{
    app::App,
    archived,
    auth::Caller,
    extract::{PathParam, PathParams},
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{game, tournament_sheet::TournamentSheet},
};
use axum::{
    extract::State,
    http::header,
    response::{IntoResponse, Response},
};
use faceoff_store::{Game, GameRecording, GameState, StoreError};
use faceoff_types::{GameId, Side};

/// A side's own file of a game, a zip archive: what it saw, what it commanded, which command took effect, and the true
/// motion; for its team at once, for everybody once the recording is published. It names no seed.
#[utoipa::path(
    get, path = "/games/{id}/sides/{side}", tag = "team", security((), ("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path), ("side" = u32, Path, description = "1: home, 2: away")),
    responses(
        (status = 200, body = Vec<u8>, content_type = "application/zip"),
        (status = 401), (status = 403), (status = 404),
        (status = 409, description = "the game has no result, or no recording: of the schedule played again none is kept"),
    )
)]
pub(crate) async fn side(
    viewer: Viewer,
    State(app): State<App>,
    PathParams(path): PathParams<String, 2>,
) -> Result<Response, Problem> {
    let (id, side) = side_of(&path)?;
    let (sheet, game) = game::known(&app, viewer, id).await?;
    let sight = sheet.sight(viewer);
    if !sight.is_own(&game, side) && !sight.sees_both_sides(&game) {
        return Err(sight.refused(&game, &format!("the file of side {}", side.number())));
    }
    let files = recording_of(&game)?;
    let name = format!("side-{}.zip", side.number());
    send(&app, &sheet, &game, files, &name).await
}

/// The recording of both sides with the game's seed, a zip archive that `faceoff verify` plays again; for organisers at
/// once, for everybody once it is published.
#[utoipa::path(
    get, path = "/games/{id}/recording", tag = "public", security((), ("organiser" = [])),
    params(("id" = GameId, Path)),
    responses(
        (status = 200, body = Vec<u8>, content_type = "application/zip"),
        (status = 401), (status = 403), (status = 404),
        (status = 409, description = "the game has no result, or no recording: of the schedule played again none is kept"),
    )
)]
pub(crate) async fn recording(
    viewer: Viewer,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Response, Problem> {
    let (sheet, game) = game::known(&app, viewer, id).await?;
    let sight = sheet.sight(viewer);
    if !sight.sees_both_sides(&game) {
        return Err(sight.refused(&game, "the recording of both sides"));
    }
    let files = recording_of(&game)?;
    send(&app, &sheet, &game, files, "game.zip").await
}

/// The end of what a side's agent wrote to its standard error in the attempt that counts, with its faults; for its team
/// and organisers alone.
#[utoipa::path(
    get, path = "/games/{id}/sides/{side}/log", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path), ("side" = u32, Path, description = "1: home, 2: away")),
    responses(
        (status = 200, body = String, content_type = "text/plain"),
        (status = 403), (status = 404),
        (status = 409, description = "the game has no result"),
    )
)]
pub(crate) async fn side_log(
    caller: Caller,
    State(app): State<App>,
    PathParams(path): PathParams<String, 2>,
) -> Result<Response, Problem> {
    let (id, side) = side_of(&path)?;
    let viewer = Viewer::of(&caller);
    let (sheet, game) = game::known(&app, viewer, id).await?;
    if !sheet.sight(viewer).is_own(&game, side) {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            format!(
                "the log of side {} is for its team and organisers, and stays so",
                side.number()
            ),
        ));
    }
    let Some(log) = app.store.game_log(id, side).await? else {
        return Err(no_result(&game));
    };
    let media_type = [(header::CONTENT_TYPE, "text/plain; charset=utf-8")];
    Ok((media_type, faceoff_types::harmless(&log).into_owned()).into_response())
}

fn side_of([id, side]: &[String; 2]) -> Result<(GameId, Side), Problem> {
    let id = id.parse().map_err(|error: faceoff_types::ParseIdError| {
        Problem::new(ProblemKind::NotFound, error.to_string())
    })?;
    let side = side
        .parse::<u32>()
        .ok()
        .and_then(|number| Side::BOTH.into_iter().find(|side| side.number() == number));
    let side = side.ok_or_else(|| {
        Problem::new(
            ProblemKind::NotFound,
            "a game has the sides 1 (home) and 2 (away)",
        )
    })?;
    Ok((id, side))
}

fn recording_of(game: &Game) -> Result<&GameRecording, Problem> {
    match &game.state {
        GameState::Played(row) => row.recording.as_ref().ok_or_else(|| {
            Problem::new(
                ProblemKind::Conflict,
                "no recording is kept of the schedule played again; the game that counts has one",
            )
        }),
        _ => Err(no_result(game)),
    }
}

fn no_result(game: &Game) -> Problem {
    let why = match &game.state {
        GameState::Queued | GameState::Running { .. } => {
            "it is not over; follow it until its state is “played”"
        }
        GameState::Broken { .. } => {
            "it was broken by our fault, and the organiser has it played again"
        }
        GameState::Void { .. } => "its result was voided, and the organiser has it played again",
        GameState::Cancelled { .. } => "it was called off",
        GameState::Played(_) => "it has nothing of this kind",
    };
    Problem::new(
        ProblemKind::Conflict,
        format!("the game has no result: {why}"),
    )
}

async fn send(
    app: &App,
    sheet: &TournamentSheet,
    game: &Game,
    files: &GameRecording,
    file: &str,
) -> Result<Response, Problem> {
    let key = format!("{}/{file}", files.key);
    archived::check_kept(app, &key, "recording").await?;
    let [home, away] = game.teams;
    let name = plain(&format!(
        "faceoff-{}-{}",
        sheet.name(home)?,
        sheet.name(away)?
    ));
    match download(app, &key, "application/zip", &format!("{name}-{file}")).await {
        Err(StoreError::NotFound(_)) => {
            // It may have been voided meanwhile, and what it had be gone. One that is promised must be there.
            recording_of(&app.store.game(game.id).await?)?;
            Err(Problem::internal(format_args!("{key} is lost")))
        }
        answer => Ok(answer?),
    }
}

/// Nothing that a header or a file system could trip over.
fn plain(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect()
}
