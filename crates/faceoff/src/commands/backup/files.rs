//! Files as a backup holds them: for their owner alone, hashed on the way, on disk before they count.

use super::super::staging;
use anyhow::Context;
use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions, Permissions},
    io::{ErrorKind, Read, Write},
    os::unix::fs::{OpenOptionsExt, PermissionsExt},
    path::Path,
};

/// In memory at a time.
const PIECE_BYTES: usize = 1 << 20;

/// A file that was copied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Copied {
    pub bytes: u64,
    /// BLAKE3, 64 hexadecimal digits.
    pub blake3: String,
}

/// Copies a file to a new one.
///
/// # Errors
/// If it cannot be read, or the copy is there or cannot be written.
pub fn copy_whole(from: &Path, to: &Path) -> anyhow::Result<Copied> {
    let source = File::open(from).with_context(|| format!("reading {}", from.display()))?;
    copy_opened(source, from, to)
}

fn copy_opened(mut source: File, from: &Path, to: &Path) -> anyhow::Result<Copied> {
    let writing = || format!("writing {}", to.display());
    let mut copy = new_file(to)?;
    let mut hash = blake3::Hasher::new();
    let mut piece = vec![0; PIECE_BYTES];
    let mut bytes = 0;
    loop {
        let read = match source.read(&mut piece) {
            Ok(0) => break,
            Ok(read) => read,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => {
                return Err(error).with_context(|| format!("reading {}", from.display()));
            }
        };
        hash.update(&piece[..read]);
        copy.write_all(&piece[..read]).with_context(writing)?;
        bytes += read as u64;
    }
    copy.sync_all().with_context(writing)?;
    Ok(Copied {
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
/// If it is there, or the disk refuses.
pub fn write(path: &Path, text: &[u8]) -> anyhow::Result<()> {
    let mut file = new_file(path)?;
    file.write_all(text)
        .and_then(|()| file.sync_all())
        .with_context(|| format!("writing {}", path.display()))
}

/// Makes a file that somebody else has written as the others are, and hashes it.
///
/// # Errors
/// If it cannot be read or changed.
pub fn settle(path: &Path) -> anyhow::Result<Copied> {
    fs::set_permissions(path, Permissions::from_mode(0o600))
        .and_then(|()| File::open(path)?.sync_all())
        .with_context(|| format!("writing {}", path.display()))?;
    hashed(path)
}

/// A file's length and hash.
///
/// # Errors
/// If it cannot be read.
pub fn hashed(path: &Path) -> anyhow::Result<Copied> {
    let hash = || -> std::io::Result<Copied> {
        let file = File::open(path)?;
        let mut hash = blake3::Hasher::new();
        hash.update_reader(&file)?;
        Ok(Copied {
            bytes: file.metadata()?.len(),
            blake3: hash.finalize().to_string(),
        })
    };
    hash().with_context(|| format!("reading {}", path.display()))
}

/// Copies all files of a folder and of those in it, and notes them under `name/…`. What goes meanwhile is left out: the
/// database's copy, which is older, says whether it is missed. So is what is half written.
///
/// # Errors
/// If something cannot be read or written.
pub fn copy_tree(
    from: &Path,
    to: &Path,
    name: &str,
    copied: &mut BTreeMap<String, Copied>,
) -> anyhow::Result<()> {
    staging::private(to)?;
    let reading = || format!("reading {}", from.display());
    let entries = match fs::read_dir(from) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        entries => entries.with_context(reading)?,
    };
    for entry in entries {
        let entry = entry.with_context(reading)?;
        let own = entry.file_name();
        let (source, copy) = (from.join(&own), to.join(&own));
        let Some(own) = own.to_str().filter(|own| !is_half_written(own)) else {
            continue;
        };
        let path = format!("{name}/{own}");
        let kind = entry
            .file_type()
            .with_context(|| format!("reading {}", source.display()))?;
        if kind.is_dir() {
            copy_tree(&source, &copy, &path, copied)?;
        } else if kind.is_file() {
            match File::open(&source) {
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                file => {
                    let file = file.with_context(|| format!("reading {}", source.display()))?;
                    copied.insert(path, copy_opened(file, &source, &copy)?);
                }
            }
        }
    }
    staging::sync(to)
}

/// The store writes an artifact beside its place first, with a number after its name.
fn is_half_written(name: &str) -> bool {
    name.rsplit_once('#')
        .is_some_and(|(_, number)| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_half_written_is_known_by_its_name() {
        assert!(is_half_written("bundle.tar.gz#3"));
        assert!(!is_half_written("bundle.tar.gz"));
        assert!(!is_half_written("a#b"));
    }

    #[test]
    fn a_copy_is_private_and_never_takes_the_place_of_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let (from, to) = (folder.path().join("from"), folder.path().join("to"));
        fs::write(&from, "text").unwrap();
        let copied = copy_whole(&from, &to).unwrap();
        assert_eq!(copied.blake3, blake3::hash(b"text").to_string());
        assert_eq!(copied, settle(&to).unwrap());
        assert_eq!(to.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        assert!(copy_whole(&from, &to).is_err());
    }
}
