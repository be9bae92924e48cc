//! Files of games: recordings of one side and of both sides, links to them, and logs. Side 1 plays at home, side 2 away.
//! Games count, or belong to a *replay of the schedule*: a repetition of all games with other seeds, which does not count.

use super::{
    document::{Binary, FileHeaders},
    downloads::{Download, download, file_stem},
};
use crate::download_links::{self, LinkOr, LinkQuery};
use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_api::{paths, requests::NewLink, views::link::LinkView};
use faceoff_service::{
    app::App,
    archive_contents,
    auth::Caller,
    extract::{OptionalJson, PathParam, PathParams, parse_path_param},
    problem::{Problem, ProblemKind},
    request_preconditions::RequestPreconditions,
    viewer::Viewer,
    views::{game, tournament_state::TournamentState},
};
use faceoff_store::{Game, GameRecording, GameState, StoreError};
use faceoff_types::{GameId, Side};

/// Downloads a side's recording of a game, a zip file: observations, actions, which actions took effect, and the true
/// motion.
///
/// For its team at once, for everyone once the recording is public. It does not contain the seed.
#[utoipa::path(
    get, path = "/games/{id}/sides/{side}", tag = "team", security((), ("team" = []), ("organiser" = [])),
    params(
        ("id" = GameId, Path), ("side" = u32, Path, minimum = 1, maximum = 2, description = "1: home, 2: away"),
        FileHeaders, LinkQuery,
    ),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/zip"),
        (status = 401), (status = 403), (status = 404),
        (status = 409, description = "the game has no result or no recording; games of a schedule replay are not recorded"),
        (status = 410, description = "the link has expired, or the season archive does not contain the file"),
    )
)]
pub(crate) async fn side(
    LinkOr(viewer): LinkOr<Viewer>,
    conditions: RequestPreconditions,
    State(app): State<App>,
    PathParams(path): PathParams<String, 2>,
) -> Result<Response, Problem> {
    let (id, side) = parse_side(&path)?;
    let recording = StoredRecording::find(&app, viewer, id, GameFile::Side(side)).await?;
    recording.send(&app, &conditions).await
}

/// Downloads the recording of both sides with the game's seed, a zip file that `faceoff verify` replays.
///
/// For organisers at once, for everyone once it is public.
#[utoipa::path(
    get, path = "/games/{id}/recording", tag = "public", security((), ("organiser" = [])),
    params(("id" = GameId, Path), FileHeaders, LinkQuery),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/zip"),
        (status = 401), (status = 403), (status = 404),
        (status = 409, description = "the game has no result or no recording; games of a schedule replay are not recorded"),
        (status = 410, description = "the link has expired, or the season archive does not contain the file"),
    )
)]
pub(crate) async fn recording(
    LinkOr(viewer): LinkOr<Viewer>,
    conditions: RequestPreconditions,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Response, Problem> {
    let recording = StoredRecording::find(&app, viewer, id, GameFile::BothSides).await?;
    recording.send(&app, &conditions).await
}

/// Creates a link that downloads a side's recording without a token for a limited time. For callers who may download it
/// now.
///
/// Permissions are checked when the link is used, as for its creator.
#[utoipa::path(
    post, path = "/games/{id}/sides/{side}/link", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path), ("side" = u32, Path, minimum = 1, maximum = 2, description = "1: home, 2: away")),
    request_body(content = Option<NewLink>, content_type = "application/json"),
    responses(
        (status = 201, body = LinkView),
        (status = 404),
        (status = 409, description = "the game has no result or no recording"),
        (status = 422),
    )
)]
pub(crate) async fn link_side(
    caller: Caller,
    State(app): State<App>,
    PathParams(path): PathParams<String, 2>,
    OptionalJson(request): OptionalJson<NewLink>,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    let (id, side) = parse_side(&path)?;
    StoredRecording::find(&app, Viewer::new(&caller), id, GameFile::Side(side)).await?;
    let path = format!("{}/sides/{}", paths::game(id), side.number());
    download_links::link(&app, &caller, &path, request).await
}

/// Creates a link that downloads the recording of both sides without a token for a limited time. For callers who may
/// download it now.
///
/// Permissions are checked when the link is used, as for its creator.
#[utoipa::path(
    post, path = "/games/{id}/recording/link", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path)),
    request_body(content = Option<NewLink>, content_type = "application/json"),
    responses(
        (status = 201, body = LinkView),
        (status = 404),
        (status = 409, description = "the game has no result or no recording"),
        (status = 422),
    )
)]
pub(crate) async fn link_recording(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
    OptionalJson(request): OptionalJson<NewLink>,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    StoredRecording::find(&app, Viewer::new(&caller), id, GameFile::BothSides).await?;
    let path = format!("{}/recording", paths::game(id));
    download_links::link(&app, &caller, &path, request).await
}

/// Returns the faults and the last part of the standard error of a side's agent, from the attempt that counts. For its
/// team and organisers.
#[utoipa::path(
    get, path = "/games/{id}/sides/{side}/log", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path), ("side" = u32, Path, minimum = 1, maximum = 2, description = "1: home, 2: away")),
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
    let (id, side) = parse_side(&path)?;
    let viewer = Viewer::new(&caller);
    let (state, game) = game::find_visible(&app, viewer, id).await?;
    if !state.visibility(viewer).has_team_access(&game, side) {
        return Err(Problem::new(
            ProblemKind::Forbidden,
            format!(
                "the log of side {} is visible only to its team and organisers",
                side.number()
            ),
        ));
    }
    let Some(log) = app.store.game_log(id, side).await? else {
        return Err(no_result(&game));
    };
    let media_type = [(header::CONTENT_TYPE, "text/plain; charset=utf-8")];
    Ok((
        media_type,
        faceoff_types::escape_unprintable(&log).into_owned(),
    )
        .into_response())
}

pub(super) fn parse_side([id, side]: &[String; 2]) -> Result<(GameId, Side), Problem> {
    let id = parse_path_param(id)?;
    let side = side
        .parse::<u32>()
        .ok()
        .and_then(|number| Side::BOTH.into_iter().find(|side| side.number() == number));
    let side = side
        .ok_or_else(|| Problem::new(ProblemKind::NotFound, "expected side 1 (home) or 2 (away)"))?;
    Ok((id, side))
}

fn stored_recording(game: &Game) -> Result<&GameRecording, Problem> {
    match &game.state {
        GameState::Played(result) => result.recording.as_ref().ok_or_else(|| {
            Problem::new(
                ProblemKind::Conflict,
                "games of a schedule replay are not recorded; the game that counts has a recording",
            )
        }),
        _ => Err(no_result(game)),
    }
}

fn no_result(game: &Game) -> Problem {
    let reason = match &game.state {
        GameState::Queued | GameState::Running { .. } => {
            "it has not ended; poll it until its state is “played”"
        }
        GameState::PlatformFailed { .. } => {
            "it failed by a platform fault, and an organiser has to rerun it"
        }
        GameState::Void { .. } => "its result was voided, and an organiser has to rerun it",
        GameState::Cancelled { .. } => "it was cancelled",
        GameState::Played(_) => "it has no such file",
    };
    Problem::new(
        ProblemKind::Conflict,
        format!("the game has no result: {reason}"),
    )
}

/// Which recording of a game is requested.
#[derive(Debug, Clone, Copy)]
enum GameFile {
    BothSides,
    Side(Side),
}

/// A recording that the viewer may download now.
#[derive(Debug)]
struct StoredRecording {
    game: GameId,
    /// Artifact key of the file.
    key: String,
    blake3: String,
    /// File name for the client.
    name: String,
}

impl StoredRecording {
    async fn find(app: &App, viewer: Viewer, id: GameId, file: GameFile) -> Result<Self, Problem> {
        let (state, game) = game::find_visible(app, viewer, id).await?;
        let visibility = state.visibility(viewer);
        let is_own = match file {
            GameFile::BothSides => false,
            GameFile::Side(side) => visibility.has_team_access(&game, side),
        };
        if !is_own && !visibility.can_see_both_sides(&game) {
            let description = match file {
                GameFile::BothSides => "the recording of both sides".to_owned(),
                GameFile::Side(side) => format!("the file of side {}", side.number()),
            };
            return Err(visibility.denial(&game, &description));
        }
        let files = stored_recording(&game)?;
        let (file_name, blake3) = match file {
            GameFile::BothSides => ("game.zip".to_owned(), &files.game_blake3),
            GameFile::Side(side) => {
                let file_name = format!("side-{}.zip", side.number());
                (file_name, &files.side_blake3[side.index()])
            }
        };
        let key = format!("{}/{file_name}", files.key);
        archive_contents::check_included(app, &key, "recording").await?;
        Ok(Self {
            game: id,
            name: download_name(&state, &game, &file_name)?,
            key,
            blake3: blake3.clone(),
        })
    }

    async fn send(
        &self,
        app: &App,
        conditions: &RequestPreconditions,
    ) -> Result<Response, Problem> {
        let file = Download {
            key: &self.key,
            blake3: Some(&self.blake3),
            media_type: "application/zip",
            name: &self.name,
        };
        match download(app, conditions, file).await {
            Err(StoreError::NotFound(_)) => {
                // The game may have been voided meanwhile, and its files removed. Otherwise the file is lost.
                stored_recording(&app.store.game(self.game).await?)?;
                Err(Problem::internal(format_args!("{} is lost", self.key)))
            }
            result => Ok(result?),
        }
    }
}

fn download_name(state: &TournamentState, game: &Game, file: &str) -> Result<String, Problem> {
    let [home, away] = game.teams;
    let teams = format!("faceoff-{}-{}", state.name(home)?, state.name(away)?);
    Ok(format!("{}-{file}", file_stem(&teams)))
}
