//! Rules for an entry (file, folder or link) of an archive of any format, and the functions that write it to the disk.

use super::{budget::Budget, error::BundleError, sink::FileAttributes};
use fs_err::OpenOptions;
use rustix::fs::{AtFlags, CWD, Timespec, Timestamps, utimensat};
use std::{
    fs::Permissions,
    io::{self, Read, Write},
    os::unix::fs::PermissionsExt,
    path::Path,
};

/// Mode of all folders. It is set explicitly, whatever this process's umask: if this process is root, agents run as other users, who
/// must be able to read them.
pub(super) const FOLDER_MODE: u32 = 0o755;
/// Longest path in an archive, in bytes; together with the target folder it must stay below the system's 4096.
pub(super) const PATH_MAX_BYTES: usize = 1024;
/// Longest name of a file or folder on Linux, in bytes.
const NAME_MAX_BYTES: usize = 255;
/// The time of everything for which the archive states none: 2000-01-01 00:00 UTC, in seconds since 1970. No agent can tell from its
/// files when they were unpacked, and so whether it plays in a validation run.
const DEFAULT_TIME_S: u32 = 946_684_800;

/// An error for an invalid entry.
pub(super) fn invalid(entry: &str, problem: impl std::fmt::Display) -> BundleError {
    let shown: String = entry.chars().take(200).collect();
    BundleError::Invalid(format!("entry {shown:?} {problem}"))
}

/// First bytes of a file in which macOS keeps what other systems do not keep of a file: AppleDouble, RFC 1740.
pub(super) const APPLE_DOUBLE: [u8; 4] = [0x00, 0x05, 0x16, 0x07];

/// Whether an operating system has put the entry into the archive, beside the team's files. macOS adds metadata (`__MACOSX`,
/// `.DS_Store`), Windows settings of folders.
pub(super) fn is_system_file(entry: &str) -> bool {
    let is_system_name =
        |part: &str| ["__MACOSX", ".DS_Store", "Thumbs.db", "desktop.ini"].contains(&part);
    entry.split('/').any(is_system_name)
}

/// Whether the entry is named like the metadata of macOS; it is such if it begins with [`APPLE_DOUBLE`].
pub(super) fn is_named_like_metadata(entry: &str) -> bool {
    entry
        .rsplit('/')
        .next()
        .is_some_and(|name| name.starts_with("._"))
}

/// The entry's path without `.` parts; empty for the archive's root.
pub(super) fn normalise(entry: &str) -> Result<String, BundleError> {
    if entry.is_empty() {
        return Err(invalid(entry, "has no name"));
    }
    if entry.contains('\0') {
        return Err(invalid(entry, "has a NUL character in its name"));
    }
    if entry.starts_with('/') {
        return Err(invalid(entry, "has an absolute path"));
    }
    let parts: Vec<&str> = entry
        .split('/')
        .filter(|part| !matches!(*part, "" | "."))
        .collect();
    if parts.contains(&"..") {
        return Err(invalid(entry, "has '..' in its path"));
    }
    if entry.len() > PATH_MAX_BYTES || parts.iter().any(|part| part.len() > NAME_MAX_BYTES) {
        return Err(invalid(
            entry,
            format_args!(
                "has too long a path: at most {PATH_MAX_BYTES} bytes, {NAME_MAX_BYTES} per name"
            ),
        ));
    }
    Ok(parts.join("/"))
}

/// An error for an entry of a kind that neither a bundle nor a layer may contain.
pub(super) fn unusable(entry: &str, kind: &str) -> BundleError {
    invalid(
        entry,
        format_args!("is {kind}; a bundle holds files, folders and links"),
    )
}

/// Checks that a symbolic link could have this target.
pub(super) fn check_target(entry: &str, target: &str) -> Result<(), BundleError> {
    if target.is_empty() || target.contains('\0') || target.len() > PATH_MAX_BYTES {
        return Err(invalid(entry, "is a link to no possible path"));
    }
    Ok(())
}

/// Creates a folder that must not exist.
pub(super) fn make_folder(path: &Path) -> Result<(), BundleError> {
    fs_err::create_dir(path)?;
    fs_err::set_permissions(path, Permissions::from_mode(FOLDER_MODE))?;
    Ok(())
}

/// Gives a file another name.
pub(super) fn add_hard_link(entry: &str, file: &Path, path: &Path) -> Result<(), BundleError> {
    fs_err::hard_link(file, path).map_err(|error| match error.kind() {
        io::ErrorKind::TooManyLinks => invalid(
            entry,
            "is one more name than a file can have on this server",
        ),
        _ => error.into(),
    })
}

/// Writes a file that must not exist; streams and counts its content.
pub(super) fn write_new(
    entry: &str,
    path: &Path,
    attributes: FileAttributes,
    content: &mut dyn Read,
    budget: &Budget<'_>,
) -> Result<(), BundleError> {
    let is_executable = attributes.mode & 0o111 != 0;
    let file_mode = if is_executable { 0o755 } else { 0o644 };
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.set_permissions(Permissions::from_mode(file_mode))?;
    let mut buffer = vec![0; 64 << 10];
    loop {
        let read = match content.read(&mut buffer) {
            Ok(0) => break,
            Ok(read) => read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(BundleError::from_read_error(entry)(error)),
        };
        budget.count_content(entry, read)?;
        file.write_all(&buffer[..read])?;
    }
    set_time(path, attributes.modified_s.unwrap_or(DEFAULT_TIME_S))
}

/// Sets the time of a folder or a link, whose times in archives are not used.
pub(super) fn set_default_time(path: &Path) -> Result<(), BundleError> {
    set_time(path, DEFAULT_TIME_S)
}

fn set_time(path: &Path, seconds: u32) -> Result<(), BundleError> {
    let time = Timespec {
        tv_sec: seconds.into(),
        tv_nsec: 0,
    };
    let times = Timestamps {
        last_access: time,
        last_modification: time,
    };
    utimensat(CWD, path, &times, AtFlags::SYMLINK_NOFOLLOW).map_err(io::Error::from)?;
    Ok(())
}
