//! The data folder: its lock and its secrets. The *operator* is the person who runs the server; the *operator's token* has all
//! rights of an organiser.

use super::super::{
    atomic_folder::create_private,
    backup::manifest::{ARTIFACTS, DATABASE},
};
use anyhow::{Context, bail};
use faceoff_api::token::{Secret, SecretKind, hash_token};
use faceoff_dataset::allow_missing;
use faceoff_http::LinkKey;
use faceoff_store::Store;
use jiff::Timestamp;
use std::{
    fs::{self, File, OpenOptions, Permissions, TryLockError},
    io::{Read as _, Seek as _, Write as _},
    os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt},
    path::Path,
    thread,
    time::{Duration, Instant},
};

/// Name of the file with the operator's token.
pub const ADMIN_TOKEN_FILE: &str = "admin-token";

/// Name of the file with the key that signs download links, from which the key of workers' grants derives. Backups do not contain it.
const LINK_KEY_FILE: &str = "links.key";

/// Name of the lock file, which is inside the data folder so that it moves with it.
const LOCK_FILE: &str = "serving.lock";

/// How long the lock of a dead process may remain: until a child that it has forked calls exec.
const MAX_STALE_LOCK: Duration = Duration::from_secs(10);

/// Locks the data folder for this process, until the file is dropped or the process ends. The holder of the lock may
/// remove what other processes have left.
///
/// # Errors
/// If another process has the lock. Nothing has been changed then.
pub fn lock(data_dir: &Path) -> anyhow::Result<File> {
    let path = data_dir.join(LOCK_FILE);
    let context = || format!("locking the data folder with {}", path.display());
    let mut file = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(&path)
        .with_context(context)?;
    let started_at = Instant::now();
    loop {
        match file.try_lock() {
            Ok(()) => break,
            Err(TryLockError::Error(error)) => {
                let context = context();
                return Err(error)
                    .context(format!("{context}; does its file system support locks?"));
            }
            Err(TryLockError::WouldBlock) => {
                let holder = read_holder(&mut file);
                if holder.is_some_and(is_alive) || started_at.elapsed() > MAX_STALE_LOCK {
                    let holder = holder.map_or_else(
                        || "another process".to_owned(),
                        |id| format!("process {id}"),
                    );
                    bail!(
                        "the data folder {} is in use by {holder}: stop it first, or name another folder with \
                        --data-dir",
                        data_dir.display()
                    );
                }
                thread::sleep(Duration::from_millis(50));
            }
        }
    }
    // A restore may have renamed the folder in between.
    let (locked, current) = (
        file.metadata().with_context(context)?,
        fs::metadata(&path).with_context(context)?,
    );
    if (locked.dev(), locked.ino()) != (current.dev(), current.ino()) {
        bail!(
            "the data folder {} has just been replaced; start again",
            data_dir.display()
        );
    }
    file.set_len(0)
        .and_then(|()| file.rewind())
        .and_then(|()| writeln!(file, "{}", std::process::id()))
        .with_context(context)?;
    Ok(file)
}

/// Closes the files of the data folder to other users: earlier versions, copies and other programs may have left them open. The mode
/// of the folder itself, which may contain other things, stays.
///
/// # Errors
/// If a mode cannot be read or changed.
pub fn close_to_others(data_dir: &Path) -> anyhow::Result<()> {
    const GROUP_AND_OTHERS: u32 = 0o077;
    const NAMES: [&str; 7] = [
        DATABASE,
        "faceoff.sqlite3-wal",
        "faceoff.sqlite3-shm",
        ARTIFACTS,
        ADMIN_TOKEN_FILE,
        LINK_KEY_FILE,
        LOCK_FILE,
    ];
    for name in NAMES {
        let path = data_dir.join(name);
        let close = || -> std::io::Result<()> {
            let mode = fs::metadata(&path)?.permissions().mode() & 0o7777;
            if mode & GROUP_AND_OTHERS == 0 {
                return Ok(());
            }
            fs::set_permissions(&path, Permissions::from_mode(mode & !GROUP_AND_OTHERS))?;
            tracing::warn!(
                path = %path.display(),
                mode = format!("{mode:04o}"),
                "other users could read it; now only the server's user can"
            );
            Ok(())
        };
        allow_missing(close()).with_context(|| {
            format!(
                "closing {} to other users; run the server as its owner, or chmod go= it",
                path.display()
            )
        })?;
    }
    Ok(())
}

/// The process id in the lock file. It only serves error messages; the lock itself is the file lock.
fn read_holder(file: &mut File) -> Option<i32> {
    let mut text = String::new();
    file.rewind().ok()?;
    file.read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

fn is_alive(id: i32) -> bool {
    use rustix::{
        io::Errno,
        process::{Pid, test_kill_process},
    };
    Pid::from_raw(id).is_some_and(|id| test_kill_process(id) != Err(Errno::SRCH))
}

/// Creates an empty private folder, or removes everything in an existing one but the entry named `kept`.
///
/// # Errors
/// If the folder cannot be emptied or created.
pub fn empty_folder_except(folder: &Path, kept: &str) -> anyhow::Result<()> {
    create_private(folder)?;
    let emptied = fs::read_dir(folder).and_then(|mut entries| {
        entries.try_for_each(|entry| {
            let entry = entry?;
            if entry.file_name() == kept {
                Ok(())
            } else if entry.file_type()?.is_dir() {
                fs::remove_dir_all(entry.path())
            } else {
                fs::remove_file(entry.path())
            }
        })
    });
    emptied.with_context(|| format!("emptying {}", folder.display()))
}

/// The hash of the operator's token, which is created at the first start.
fn load_or_create_operator_token(data_dir: &Path) -> anyhow::Result<[u8; 32]> {
    let file = data_dir.join(ADMIN_TOKEN_FILE);
    match fs::read_to_string(&file) {
        Ok(token) if token.trim().is_empty() => bail!(
            "{} is empty; remove it, and the next start creates a new token",
            file.display()
        ),
        Ok(token) => return Ok(hash_token(token.trim())),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
        Err(error) => return Err(error).with_context(|| format!("reading {}", file.display())),
    }
    let token =
        Secret::generate(SecretKind::Operator).context("generating the operator's token")?;
    write_secret(&file, token.as_str())?;
    tracing::info!(file = %file.display(), "created the operator's token; keep the file secret");
    Ok(token.hash())
}

/// Writes a private file under a temporary name and renames it, so that a crash cannot leave half a secret.
fn write_secret(file: &Path, secret: &str) -> anyhow::Result<()> {
    let temporary = file.with_extension("new");
    let write = || -> std::io::Result<()> {
        let mut writer = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(0o600)
            .open(&temporary)?;
        writeln!(writer, "{secret}")?;
        writer.sync_all()?;
        fs::rename(&temporary, file)
    };
    write().with_context(|| format!("writing {}", file.display()))
}

/// Reads the key that signs download links, or creates it at the first start. The key that seals the grants of remote workers (access to
/// the files of a job) derives from it. If the key is lost, existing download links and grants become invalid.
///
/// # Errors
/// If the key cannot be read or written, or is invalid.
pub fn load_or_create_link_key(data_dir: &Path) -> anyhow::Result<LinkKey> {
    let file = data_dir.join(LINK_KEY_FILE);
    match fs::read_to_string(&file) {
        Ok(text) => LinkKey::from_hex(text.trim()).with_context(|| {
            format!(
                "{}: expected 64 hexadecimal digits; remove it, and the next start creates a new key",
                file.display()
            )
        }),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let key = LinkKey::generate().context("generating the key of download links")?;
            write_secret(&file, &key.to_hex())?;
            Ok(key)
        }
        Err(error) => Err(error).with_context(|| format!("reading {}", file.display())),
    }
}

/// Registers the operator's token in the store. If the token in the file has been revoked, creates a new one first.
///
/// # Errors
/// If the file or the database cannot be read or written.
pub async fn register_operator_token(
    store: &Store,
    data_dir: &Path,
    now: Timestamp,
) -> anyhow::Result<()> {
    if !store
        .set_operator_token(load_or_create_operator_token(data_dir)?, now)
        .await?
    {
        let file = data_dir.join(ADMIN_TOKEN_FILE);
        tracing::warn!(file = %file.display(), "the token in the file was revoked; creating a new one");
        fs::remove_file(&file).with_context(|| format!("removing {}", file.display()))?;
        store
            .set_operator_token(load_or_create_operator_token(data_dir)?, now)
            .await?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_closed_to_other_users() {
        let folder = tempfile::tempdir().unwrap();
        fs::set_permissions(folder.path(), Permissions::from_mode(0o755)).unwrap();
        let mode = |name: &str| {
            let metadata = fs::metadata(folder.path().join(name)).unwrap();
            metadata.permissions().mode() & 0o777
        };
        for name in [DATABASE, ADMIN_TOKEN_FILE, "notes.txt"] {
            let file = folder.path().join(name);
            fs::write(&file, "").unwrap();
            fs::set_permissions(&file, Permissions::from_mode(0o644)).unwrap();
        }
        let artifacts = folder.path().join(ARTIFACTS);
        fs::create_dir(&artifacts).unwrap();
        fs::set_permissions(&artifacts, Permissions::from_mode(0o755)).unwrap();
        close_to_others(folder.path()).unwrap();
        assert_eq!((mode(DATABASE), mode(ADMIN_TOKEN_FILE)), (0o600, 0o600));
        assert_eq!(mode(ARTIFACTS), 0o700);
        assert_eq!((mode("notes.txt"), mode("")), (0o644, 0o755));
    }

    #[test]
    fn data_folder_has_one_lock_holder_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let lock_file = lock(folder.path()).unwrap();
        let refused = lock(folder.path()).unwrap_err().to_string();
        let expected = format!("in use by process {}", std::process::id());
        assert!(refused.contains(&expected), "{refused}");
        drop(lock_file);
        // The id of a process that has ended, and invalid content.
        for content in ["999999999", "", "words"] {
            fs::write(folder.path().join(LOCK_FILE), content).unwrap();
            drop(lock(folder.path()).unwrap());
        }
    }

    #[test]
    fn link_key_is_created_once_and_private() {
        let folder = tempfile::tempdir().unwrap();
        let first = load_or_create_link_key(folder.path()).unwrap().to_hex();
        assert_eq!(
            load_or_create_link_key(folder.path()).unwrap().to_hex(),
            first
        );
        let file = folder.path().join(LINK_KEY_FILE);
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        fs::write(&file, "no key\n").unwrap();
        let refused = load_or_create_link_key(folder.path())
            .unwrap_err()
            .to_string();
        assert!(refused.contains("64 hexadecimal digits"), "{refused}");
    }

    #[test]
    fn operator_token_is_created_once_and_private() {
        let folder = tempfile::tempdir().unwrap();
        let first = load_or_create_operator_token(folder.path()).unwrap();
        assert_eq!(load_or_create_operator_token(folder.path()).unwrap(), first);
        let file = folder.path().join(ADMIN_TOKEN_FILE);
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        let token = fs::read_to_string(&file).unwrap();
        assert!(token.starts_with("fo_admin_"));
        assert_eq!(hash_token(token.trim()), first);
        fs::write(&file, "\n").unwrap();
        assert!(
            load_or_create_operator_token(folder.path()).is_err(),
            "an empty token must not be accepted"
        );
    }
}
