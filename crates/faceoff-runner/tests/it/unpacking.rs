//! Unpacking of archives beside a file that must not change, and the messages of refusals.

use crate::archives::write;
use faceoff_runner::bundle::{Bundle, BundleError, BundleLimits, unpack};
use std::{fs, path::Path, time::SystemTime};
use tempfile::TempDir;

/// Unpacks an archive into the folder `out` of a new folder, and stops when `cancelled` returns true.
pub fn unpack_unless(
    bytes: &[u8],
    limits: &BundleLimits,
    cancelled: &dyn Fn() -> bool,
) -> (TempDir, Result<Bundle, BundleError>) {
    let dir = tempfile::tempdir().unwrap();
    let secret_file = dir.path().join("secret");
    fs::write(&secret_file, "secret").unwrap();
    let archive = write(dir.path(), "upload", bytes);
    let result = unpack(&archive, &dir.path().join("out"), limits, cancelled);
    // In any case nothing beside the target folder may have changed.
    assert_eq!(fs::read_to_string(secret_file).unwrap(), "secret");
    let mut names: Vec<_> = fs::read_dir(dir.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .filter(|name| name != "out")
        .collect();
    names.sort();
    assert_eq!(names, ["secret", "upload"]);
    (dir, result)
}

pub fn try_unpack(bytes: &[u8], limits: BundleLimits) -> (TempDir, Result<Bundle, BundleError>) {
    unpack_unless(bytes, &limits, &|| false)
}

/// Unpacks an archive that must be refused. Returns the folder with the leftovers, and the message.
#[track_caller]
fn unpack_refused(bytes: &[u8], limits: BundleLimits) -> (TempDir, String) {
    let (dir, result) = try_unpack(bytes, limits);
    match result {
        Err(BundleError::Invalid(message)) => (dir, message),
        other => panic!("expected a refusal, got {other:?}"),
    }
}

/// The message with which an archive is refused.
#[track_caller]
pub fn refusal(bytes: &[u8], limits: BundleLimits) -> String {
    unpack_refused(bytes, limits).1
}

/// Asserts that an archive is refused with a message that contains `part`. Returns the folder with the leftovers.
#[track_caller]
pub fn assert_refused_with_limits(bytes: &[u8], limits: BundleLimits, part: &str) -> TempDir {
    let (dir, message) = unpack_refused(bytes, limits);
    assert!(message.contains(part), "{message:?} lacks {part:?}");
    dir
}

/// As [`assert_refused_with_limits`], with the default limits.
#[track_caller]
pub fn assert_refused(bytes: &[u8], part: &str) -> TempDir {
    assert_refused_with_limits(bytes, BundleLimits::default(), part)
}

/// Time of everything whose archive states none, in seconds since 1970: 2000-01-01.
pub const DEFAULT_TIME_S: u64 = 946_684_800;

/// Time of change, in seconds since 1970. A link is not followed.
pub fn time_of(path: &Path) -> u64 {
    let modified = path.symlink_metadata().unwrap().modified().unwrap();
    modified
        .duration_since(SystemTime::UNIX_EPOCH)
        .unwrap()
        .as_secs()
}
