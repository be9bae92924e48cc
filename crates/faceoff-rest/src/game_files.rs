//! The files of games: each side's own at once, both sides' when they are published, and what agents wrote.

use super::{
    document::{Binary, FileHeaders},
    downloads::{Download, download, plain},
};
use crate::links::{self, LinkOr, LinkQuery};
use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_api::{paths, requests::NewLink, views::link::LinkView};
use faceoff_service::{
    app::App,
    archived,
    auth::Caller,
    conditions::Conditions,
    extract::{OptionalJson, PathParam, PathParams},
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{game, tournament_sheet::TournamentSheet},
};
use faceoff_store::{Game, GameRecording, GameState, StoreError};
use faceoff_types::{GameId, Side};

/// A side's own file of a game, a zip archive: what it saw, what it commanded, which command took effect, and the true
/// motion; for its team at once, for everybody once the recording is published. It names no seed.
#[utoipa::path(
    get, path = "/games/{id}/sides/{side}", tag = "team", security((), ("team" = []), ("organiser" = [])),
    params(
        ("id" = GameId, Path), ("side" = u32, Path, minimum = 1, maximum = 2, description = "1: home, 2: away"),
        FileHeaders, LinkQuery,
    ),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/zip"),
        (status = 401), (status = 403), (status = 404),
        (status = 409, description = "the game has no result, or no recording: of the schedule played again none is kept"),
        (status = 410, description = "the link has expired, or the archive that the server shows was made without the file"),
    )
)]
pub(crate) async fn side(
    LinkOr(viewer): LinkOr<Viewer>,
    conditions: Conditions,
    State(app): State<App>,
    PathParams(path): PathParams<String, 2>,
) -> Result<Response, Problem> {
    let (id, side) = side_of(&path)?;
    let recorded = Recorded::find(&app, viewer, id, Which::Side(side)).await?;
    recorded.send(&app, &conditions).await
}

/// The recording of both sides with the game's seed, a zip archive that `faceoff verify` plays again; for organisers at
/// once, for everybody once it is published.
#[utoipa::path(
    get, path = "/games/{id}/recording", tag = "public", security((), ("organiser" = [])),
    params(("id" = GameId, Path), FileHeaders, LinkQuery),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/zip"),
        (status = 401), (status = 403), (status = 404),
        (status = 409, description = "the game has no result, or no recording: of the schedule played again none is kept"),
        (status = 410, description = "the link has expired, or the archive that the server shows was made without the file"),
    )
)]
pub(crate) async fn recording(
    LinkOr(viewer): LinkOr<Viewer>,
    conditions: Conditions,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
) -> Result<Response, Problem> {
    let recorded = Recorded::find(&app, viewer, id, Which::BothSides).await?;
    recorded.send(&app, &conditions).await
}

/// A link that downloads a side's file without a token, for a time; made by whoever may download it now.
///
/// What it opens is decided when it is followed, as if whoever made it asked then.
#[utoipa::path(
    post, path = "/games/{id}/sides/{side}/link", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path), ("side" = u32, Path, minimum = 1, maximum = 2, description = "1: home, 2: away")),
    request_body(content = Option<NewLink>, content_type = "application/json"),
    responses(
        (status = 201, body = LinkView),
        (status = 404),
        (status = 409, description = "the game has no result, or no recording"),
        (status = 422),
    )
)]
pub(crate) async fn link_side(
    caller: Caller,
    State(app): State<App>,
    PathParams(path): PathParams<String, 2>,
    OptionalJson(wanted): OptionalJson<NewLink>,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    let (id, side) = side_of(&path)?;
    Recorded::find(&app, Viewer::of(&caller), id, Which::Side(side)).await?;
    let path = format!("{}/sides/{}", paths::game(id), side.number());
    links::link(&app, &caller, &path, wanted).await
}

/// A link that downloads the recording of both sides without a token, for a time; made by whoever may download it now.
///
/// What it opens is decided when it is followed, as if whoever made it asked then.
#[utoipa::path(
    post, path = "/games/{id}/recording/link", tag = "team", security(("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path)),
    request_body(content = Option<NewLink>, content_type = "application/json"),
    responses(
        (status = 201, body = LinkView),
        (status = 404),
        (status = 409, description = "the game has no result, or no recording"),
        (status = 422),
    )
)]
pub(crate) async fn link_recording(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
    OptionalJson(wanted): OptionalJson<NewLink>,
) -> Result<(StatusCode, Json<LinkView>), Problem> {
    Recorded::find(&app, Viewer::of(&caller), id, Which::BothSides).await?;
    let path = format!("{}/recording", paths::game(id));
    links::link(&app, &caller, &path, wanted).await
}

/// The end of what a side's agent wrote to its standard error in the attempt that counts, with its faults; for its team
/// and organisers alone.
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

pub(super) fn game_of(id: &str) -> Result<GameId, Problem> {
    id.parse().map_err(|error: faceoff_types::ParseIdError| {
        Problem::new(ProblemKind::NotFound, error.to_string())
    })
}

pub(super) fn side_of([id, side]: &[String; 2]) -> Result<(GameId, Side), Problem> {
    let id = game_of(id)?;
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

/// Which file of a game.
#[derive(Debug, Clone, Copy)]
enum Which {
    BothSides,
    Side(Side),
}

/// A file of a game that the viewer may have now.
#[derive(Debug)]
struct Recorded {
    game: GameId,
    key: String,
    blake3: String,
    /// To be stored as.
    name: String,
}

impl Recorded {
    async fn find(app: &App, viewer: Viewer, id: GameId, which: Which) -> Result<Self, Problem> {
        let (sheet, game) = game::known(app, viewer, id).await?;
        let sight = sheet.sight(viewer);
        let is_theirs = match which {
            Which::BothSides => false,
            Which::Side(side) => sight.is_own(&game, side),
        };
        if !is_theirs && !sight.sees_both_sides(&game) {
            let what = match which {
                Which::BothSides => "the recording of both sides".to_owned(),
                Which::Side(side) => format!("the file of side {}", side.number()),
            };
            return Err(sight.refused(&game, &what));
        }
        let files = recording_of(&game)?;
        let (file, blake3) = match which {
            Which::BothSides => ("game.zip".to_owned(), &files.game_blake3),
            Which::Side(side) => {
                let file = format!("side-{}.zip", side.number());
                (file, &files.side_blake3[side.index()])
            }
        };
        let key = format!("{}/{file}", files.key);
        archived::check_kept(app, &key, "recording").await?;
        Ok(Self {
            game: id,
            name: stored_as(&sheet, &game, &file)?,
            key,
            blake3: blake3.clone(),
        })
    }

    async fn send(&self, app: &App, conditions: &Conditions) -> Result<Response, Problem> {
        let file = Download {
            key: &self.key,
            blake3: Some(&self.blake3),
            media_type: "application/zip",
            name: &self.name,
        };
        match download(app, conditions, file).await {
            Err(StoreError::NotFound(_)) => {
                // It may have been voided meanwhile, and what it had be gone. One that is promised must be there.
                recording_of(&app.store.game(self.game).await?)?;
                Err(Problem::internal(format_args!("{} is lost", self.key)))
            }
            answer => Ok(answer?),
        }
    }
}

fn stored_as(sheet: &TournamentSheet, game: &Game, file: &str) -> Result<String, Problem> {
    let [home, away] = game.teams;
    let teams = format!("faceoff-{}-{}", sheet.name(home)?, sheet.name(away)?);
    Ok(format!("{}-{file}", plain(&teams)))
}
