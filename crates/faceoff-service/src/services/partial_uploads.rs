//! Uploads in parts. A *partial upload* is a bundle of which the first bytes have arrived: after a broken connection or a restart of
//! the server, the rest suffices. It is named by its team and by the BLAKE3 hash of the whole bundle, and lives as a file until it
//! becomes a submission, or until nothing has been added for a day.

use super::{
    bundle_stream::{self, RateGuardedBody, ReceivedBundle},
    upload_limits::{UploadLimits, acquire_slot, check_may_upload, size_limit},
};
use crate::{
    app::{App, AppState},
    auth::TeamCaller,
    boxed_future, free_space,
    partial_uploads::PartialUploadLock,
    problem::{Problem, ProblemKind},
    upload_slots::UploadSlot,
};
use axum::body::Body;
use faceoff_dataset::allow_missing;
use faceoff_types::{ArchiveFormat, TeamId};
use jiff::{SignedDuration, Timestamp};
use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::Arc,
};
use tempfile::TempPath;
use tokio::{fs::OpenOptions, io::AsyncWriteExt};

/// Folder of the partial uploads, in the folder of unfinished uploads.
pub const PARTIAL_UPLOADS_FOLDER: &str = "partial";

/// How long a partial upload is kept after its newest part.
const LIFETIME: SignedDuration = SignedDuration::from_hours(24);

/// A part of a bundle that is being uploaded.
pub struct IncomingPart {
    /// BLAKE3 hash of the whole bundle.
    pub bundle_blake3: blake3::Hash,
    /// Size of the whole bundle.
    pub bundle_bytes: u64,
    /// Number of bytes before this part.
    pub offset: u64,
    /// The bytes from there on.
    pub body: Body,
}

/// Number of bytes that have arrived.
///
/// # Errors
/// `NotFound`: none.
pub async fn received_bytes(app: &App, team: TeamId, bundle: blake3::Hash) -> Result<u64, Problem> {
    match tokio::fs::metadata(file_of(app, team, bundle)).await {
        Ok(metadata) => Ok(metadata.len()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err(nothing_received(bundle)),
        Err(error) => Err(Problem::internal(error)),
    }
}

/// Adds a part, and returns the number of bytes that have arrived. What has arrived of a part whose connection breaks is kept.
///
/// # Errors
/// As [`upload`](super::uploads::upload); `Conflict` if the part does not follow what has arrived, or if a newer connection has
/// taken the upload over.
#[boxed_future]
pub async fn receive_part(
    app: &App,
    caller: &TeamCaller,
    part: IncomingPart,
) -> Result<u64, Problem> {
    let team = caller.team.id;
    let now = app.config.clock.now();
    // Before the check of the free space, which expired uploads may occupy.
    remove_expired(&app.config.upload_dir, now).await?;
    free_space::check(app)?;
    let limits = UploadLimits::current(app).await?;
    check_may_upload(app, team, &limits).await?;
    let usage = app.store.upload_usage(team, now).await?;
    let limit = size_limit(app, limits.quota, usage, now);
    if part.bundle_bytes > limit.max_bytes {
        return Err((limit.make_problem)(Some(part.bundle_bytes)));
    }

    let file = file_of(app, team, part.bundle_blake3);
    let lock = app.partial_uploads.take_over(&name_of(&file)).await;
    let slot = acquire_slot(app, team)?;
    // In a task of its own, since this handler is dropped when the client disconnects: what has arrived must be written before
    // another connection may write.
    let app = Arc::clone(app);
    let received = tokio::spawn(async move {
        let _slot = slot;
        append(&app, team, &file, part, &lock).await
    });
    received.await.map_err(Problem::internal)?
}

/// Appends a part to the file, until it is complete or broken or its lock is taken over.
async fn append(
    app: &AppState,
    team: TeamId,
    path: &Path,
    part: IncomingPart,
    lock: &PartialUploadLock,
) -> Result<u64, Problem> {
    let opened = match OpenOptions::new().append(true).open(path).await {
        Err(error) if error.kind() == io::ErrorKind::NotFound && part.offset == 0 => {
            create(app, team, path)
        }
        opened => opened,
    };
    let mut file = match opened {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(wrong_offset(part.offset, 0));
        }
        opened => opened.map_err(free_space::write_problem)?,
    };
    let mut received = file.metadata().await.map_err(Problem::internal)?.len();
    if part.offset != received {
        return Err(wrong_offset(part.offset, received));
    }
    let mut body = RateGuardedBody::of_part(part.body, app.config.limits.min_upload_rate);
    let appended = async {
        loop {
            let chunk = tokio::select! {
                chunk = body.next_chunk() => chunk,
                () = lock.taken_over.cancelled() => Err(Problem::new(
                    ProblemKind::Conflict,
                    "a newer connection has taken this upload over",
                )),
            };
            let Some(chunk) = chunk? else {
                return Ok(());
            };
            let is_start = received == 0 && chunk.len() >= ArchiveFormat::DETECTION_BYTES;
            if is_start && ArchiveFormat::detect(&chunk).is_none() {
                // Before all the rest is sent.
                return Err(bundle_stream::not_an_archive(&chunk));
            }
            received += chunk.len() as u64;
            if received > part.bundle_bytes {
                return Err(Problem::new(
                    ProblemKind::InvalidRequest,
                    format!(
                        "expected {} bytes in all, as the header Upload-Length says, got more",
                        part.bundle_bytes
                    ),
                ));
            }
            let written = file.write_all(&chunk).await;
            written.map_err(free_space::write_problem)?;
        }
    };
    let appended: Result<(), Problem> = appended.await;
    // Also after an error, so that nothing is written once the lock is free.
    let flushed = file.flush().await.map_err(free_space::write_problem);
    appended?;
    flushed?;
    Ok(received)
}

fn wrong_offset(offset: u64, received: u64) -> Problem {
    Problem::new(
        ProblemKind::Conflict,
        format!(
            "expected the header Upload-Offset to be {received}, the number of bytes that have arrived, got {offset}; go on from there"
        ),
    )
    .with("received_bytes", received)
}

/// What an upload holds until it is stored; the lock is that of an upload in parts.
pub(super) type UploadGuards = (UploadSlot, Option<PartialUploadLock>);

/// Ends the request that uses this partial upload, if there is one, and locks the file once its bytes are written.
pub(super) async fn take_over(app: &App, team: TeamId, bundle: blake3::Hash) -> PartialUploadLock {
    let path = file_of(app, team, bundle);
    app.partial_uploads.take_over(&name_of(&path)).await
}

/// The complete bundle of a partial upload, which `guards` have locked. Its file stays where it is until [`ReceivedBundle::remove`].
///
/// # Errors
/// `NotFound`: nothing has arrived. `Conflict`: the bytes that have arrived are not those of the bundle. `UnsupportedMediaType`.
pub(super) async fn complete(
    app: &App,
    team: TeamId,
    bundle: blake3::Hash,
    guards: UploadGuards,
) -> Result<(ReceivedBundle, UploadGuards), Problem> {
    let path = file_of(app, team, bundle);
    // The thread has the guards: it reads on after the client has disconnected.
    let read = tokio::task::spawn_blocking(move || Ok((read(path, bundle)?, guards)));
    read.await.map_err(Problem::internal)?
}

fn read(path: PathBuf, expected: blake3::Hash) -> Result<ReceivedBundle, Problem> {
    let mut file = match fs::File::open(&path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(nothing_received(expected));
        }
        Err(error) => return Err(Problem::internal(error)),
    };
    let mut first_bytes = Vec::with_capacity(ArchiveFormat::DETECTION_BYTES);
    let mut start = (&mut file).take(ArchiveFormat::DETECTION_BYTES as u64);
    start
        .read_to_end(&mut first_bytes)
        .map_err(Problem::internal)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update(&first_bytes);
    hasher.update_reader(&file).map_err(Problem::internal)?;
    let (blake3, bytes) = (hasher.finalize(), hasher.count());
    if blake3 != expected {
        return Err(Problem::new(
            ProblemKind::Conflict,
            format!(
                "the {bytes} bytes that have arrived have the BLAKE3 hash {blake3}; send the missing ones with PATCH, or, if none are \
                 missing, DELETE the upload and start again"
            ),
        )
        .with("received_bytes", bytes));
    }
    let format = ArchiveFormat::detect(&first_bytes)
        .ok_or_else(|| bundle_stream::not_an_archive(&first_bytes))?;
    let mut file = TempPath::try_from_path(path).map_err(Problem::internal)?;
    // If the submission cannot be created now, the bytes need not be sent again.
    file.disable_cleanup(true);
    Ok(ReceivedBundle {
        file,
        bytes,
        blake3,
        format,
    })
}

/// Removes what has arrived.
///
/// # Errors
/// `NotFound`: nothing.
pub async fn remove(app: &App, team: TeamId, bundle: blake3::Hash) -> Result<(), Problem> {
    let _lock = take_over(app, team, bundle).await;
    match tokio::fs::remove_file(file_of(app, team, bundle)).await {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err(nothing_received(bundle)),
        Err(error) => Err(Problem::internal(error)),
    }
}

/// The BLAKE3 hash that a request names.
///
/// # Errors
/// `InvalidRequest`.
pub fn parse_hash(text: &str) -> Result<blake3::Hash, Problem> {
    blake3::Hash::from_hex(text).map_err(|_| {
        Problem::new(
            ProblemKind::InvalidRequest,
            format!(
                "expected the BLAKE3 hash of the whole bundle, 64 hexadecimal digits, got {text:?}"
            ),
        )
    })
}

fn nothing_received(bundle: blake3::Hash) -> Problem {
    Problem::new(
        ProblemKind::NotFound,
        format!("no part of a bundle with the BLAKE3 hash {bundle} has arrived from your team"),
    )
}

fn folder(app: &AppState) -> PathBuf {
    app.config.upload_dir.join(PARTIAL_UPLOADS_FOLDER)
}

fn file_of(app: &AppState, team: TeamId, bundle: blake3::Hash) -> PathBuf {
    folder(app).join(format!("{team}-{bundle}"))
}

/// The file's name, by which it is locked.
fn name_of(file: &Path) -> String {
    let name = file.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Removes the partial uploads of all teams to which nothing was added for a day.
///
/// # Errors
/// If a file cannot be removed.
pub async fn remove_expired(upload_dir: &Path, now: Timestamp) -> Result<(), Problem> {
    let folder = upload_dir.join(PARTIAL_UPLOADS_FOLDER);
    let removed = tokio::task::spawn_blocking(move || {
        for (modified, path) in files_in(&folder)? {
            if now.duration_since(modified) > LIFETIME {
                allow_missing(fs::remove_file(path))?;
            }
        }
        Ok(())
    });
    removed
        .await
        .map_err(Problem::internal)?
        .map_err(|error: io::Error| Problem::internal(error))
}

/// Creates the file of a new partial upload, and removes the team's oldest ones if it has too many. Those in use stay.
fn create(app: &AppState, team: TeamId, path: &Path) -> io::Result<tokio::fs::File> {
    let folder = folder(app);
    fs::create_dir_all(&folder)?;
    // No other upload begins between the count and the creation.
    let in_use = app.partial_uploads.in_use();
    let prefix = format!("{team}-");
    let mut of_team: Vec<(Timestamp, PathBuf)> = files_in(&folder)?
        .into_iter()
        .filter(|(_, path)| name_of(path).starts_with(&prefix))
        .collect();
    of_team.sort();
    let excess = (of_team.len() + 1).saturating_sub(app.config.limits.team_uploads);
    let unused = of_team
        .iter()
        .filter(|(_, path)| !in_use.contains(&name_of(path)));
    for (_, path) in unused.take(excess) {
        allow_missing(fs::remove_file(path))?;
    }
    let file = fs::OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)?;
    Ok(tokio::fs::File::from_std(file))
}

/// The files of a folder with their times of change; none if there is no folder.
fn files_in(folder: &Path) -> io::Result<Vec<(Timestamp, PathBuf)>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let mut files = Vec::new();
    for entry in entries {
        let entry = entry?;
        // Another request may have removed it meanwhile.
        if let Ok(modified) = entry.metadata().and_then(|metadata| metadata.modified()) {
            let modified = Timestamp::try_from(modified).unwrap_or(Timestamp::MIN);
            files.push((modified, entry.path()));
        }
    }
    Ok(files)
}
