//! Files of a backup: readable by their owner only, hashed while they are copied, and synced to disk.

use super::super::atomic_folder;
use anyhow::Context;
use rustix::fs::OFlags;
use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions, Permissions},
    io::{ErrorKind, Read, Write},
    os::unix::fs::{OpenOptionsExt, PermissionsExt},
    path::Path,
};

/// Size of the copy buffer.
const BUFFER_BYTES: usize = 1 << 20;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CopiedFile {
    pub bytes: u64,
    /// BLAKE3, 64 hexadecimal digits.
    pub blake3: String,
}

/// Opens a regular file for reading. Anything else is refused, since no backup contains it: reading a pipe, for example, could wait
/// without end.
///
/// # Errors
/// If it is no regular file, or cannot be read.
pub fn open_regular(path: &Path) -> std::io::Result<File> {
    // Opening a pipe would already wait, and a link could lead out of the backup.
    let flags = OFlags::NONBLOCK | OFlags::NOFOLLOW;
    let file = OpenOptions::new()
        .read(true)
        .custom_flags(flags.bits().cast_signed())
        .open(path)?;
    if file.metadata()?.is_file() {
        return Ok(file);
    }
    Err(std::io::Error::new(
        ErrorKind::InvalidInput,
        "expected a regular file, got something else",
    ))
}

/// Copies a file to a new one.
///
/// # Errors
/// If the source cannot be read, or the target exists or cannot be written.
pub fn copy_file(from: &Path, to: &Path) -> anyhow::Result<CopiedFile> {
    let source = open_regular(from).with_context(|| format!("reading {}", from.display()))?;
    copy_open_file(source, from, to)
}

fn copy_open_file(mut source: File, from: &Path, to: &Path) -> anyhow::Result<CopiedFile> {
    let writing = || format!("writing {}", to.display());
    let mut copy = new_file(to)?;
    let mut hash = blake3::Hasher::new();
    let mut buffer = vec![0; BUFFER_BYTES];
    let mut bytes = 0;
    loop {
        let read = match source.read(&mut buffer) {
            Ok(0) => break,
            Ok(read) => read,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => {
                return Err(error).with_context(|| format!("reading {}", from.display()));
            }
        };
        hash.update(&buffer[..read]);
        copy.write_all(&buffer[..read]).with_context(writing)?;
        bytes += read as u64;
    }
    copy.sync_all().with_context(writing)?;
    Ok(CopiedFile {
        bytes,
        blake3: hash.finalize().to_string(),
    })
}

fn new_file(path: &Path) -> anyhow::Result<File> {
    OpenOptions::new()
        .write(true)
        .create_new(true)
        .mode(0o600)
        .open(path)
        .with_context(|| format!("writing {}", path.display()))
}

/// Writes a new file.
///
/// # Errors
/// If the file exists or cannot be written.
pub fn write(path: &Path, text: &[u8]) -> anyhow::Result<()> {
    let mut file = new_file(path)?;
    file.write_all(text)
        .and_then(|()| file.sync_all())
        .with_context(|| format!("writing {}", path.display()))
}

/// Restricts a file to its owner, syncs it to disk and hashes it.
///
/// # Errors
/// If the file cannot be read or changed.
pub fn make_private(path: &Path) -> anyhow::Result<CopiedFile> {
    fs::set_permissions(path, Permissions::from_mode(0o600))
        .and_then(|()| open_regular(path)?.sync_all())
        .with_context(|| format!("writing {}", path.display()))?;
    hash_file(path)
}

/// Length and hash of a file.
///
/// # Errors
/// If the file cannot be read.
pub fn hash_file(path: &Path) -> anyhow::Result<CopiedFile> {
    let hash = || -> std::io::Result<CopiedFile> {
        let file = open_regular(path)?;
        let mut hash = blake3::Hasher::new();
        hash.update_reader(&file)?;
        Ok(CopiedFile {
            bytes: file.metadata()?.len(),
            blake3: hash.finalize().to_string(),
        })
    };
    hash().with_context(|| format!("reading {}", path.display()))
}

/// Copies a folder recursively and records its files as `name/…` in `copied`. Files that are deleted meanwhile or
/// only half written are left out. Whether a file is missing is decided by the copy of the database, which was made before.
///
/// # Errors
/// If something cannot be read or written.
pub fn copy_tree(
    from: &Path,
    to: &Path,
    name: &str,
    copied: &mut BTreeMap<String, CopiedFile>,
) -> anyhow::Result<()> {
    atomic_folder::create_private(to)?;
    let reading = || format!("reading {}", from.display());
    let entries = match fs::read_dir(from) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        entries => entries.with_context(reading)?,
    };
    for entry in entries {
        let entry = entry.with_context(reading)?;
        let file_name = entry.file_name();
        let (source, copy) = (from.join(&file_name), to.join(&file_name));
        let Some(file_name) = file_name
            .to_str()
            .filter(|file_name| !is_half_written(file_name))
        else {
            continue;
        };
        let path = format!("{name}/{file_name}");
        let kind = entry
            .file_type()
            .with_context(|| format!("reading {}", source.display()))?;
        if kind.is_dir() {
            copy_tree(&source, &copy, &path, copied)?;
        } else if kind.is_file() {
            match open_regular(&source) {
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                file => {
                    let file = file.with_context(|| format!("reading {}", source.display()))?;
                    copied.insert(path, copy_open_file(file, &source, &copy)?);
                }
            }
        }
    }
    atomic_folder::sync(to)
}

/// The store first writes an artifact to a temporary file with `#` and a number after its name.
fn is_half_written(name: &str) -> bool {
    name.rsplit_once('#')
        .is_some_and(|(_, number)| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_written_file_is_recognised_by_its_name() {
        assert!(is_half_written("bundle.tar.gz#3"));
        assert!(!is_half_written("bundle.tar.gz"));
        assert!(!is_half_written("a#b"));
    }

    #[test]
    fn pipes_are_refused_and_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        rustix::fs::mknodat(
            rustix::fs::CWD,
            &pipe,
            rustix::fs::FileType::Fifo,
            rustix::fs::Mode::RUSR,
            0,
        )
        .unwrap();
        for refused in [
            hash_file(&pipe),
            copy_file(&pipe, &folder.path().join("copy")),
        ] {
            let error = format!("{:#}", refused.unwrap_err());
            assert!(error.contains("expected a regular file"), "{error}");
        }
    }

    #[test]
    fn copy_is_private_and_never_overwrites_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let (from, to) = (folder.path().join("from"), folder.path().join("to"));
        fs::write(&from, "text").unwrap();
        let copied = copy_file(&from, &to).unwrap();
        assert_eq!(copied.blake3, blake3::hash(b"text").to_string());
        assert_eq!(copied, make_private(&to).unwrap());
        assert_eq!(to.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        assert!(copy_file(&from, &to).is_err());
    }
}
