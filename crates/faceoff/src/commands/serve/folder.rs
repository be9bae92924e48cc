//! The data folder, and the organiser's token in it.

use super::super::staging::private;
use anyhow::{Context, bail};
use faceoff_api::token::{Secret, SecretKind, hash_token};
use faceoff_http::LinkKey;
use faceoff_store::Store;
use jiff::Timestamp;
use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{Read as _, Seek as _, Write as _},
    os::unix::fs::{MetadataExt, OpenOptionsExt},
    path::Path,
    thread,
    time::{Duration, Instant},
};

/// The file in the data folder that holds the organiser's token.
pub const ADMIN_TOKEN_FILE: &str = "admin-token";

/// The file in the data folder that links are signed with. No backup has it.
const LINK_KEY_FILE: &str = "links.key";

/// By which a data folder that is in use is known; inside it, so that it goes where the folder goes.
const CLAIM: &str = "serving.lock";

/// How long a dead process may keep its claim: through a child that it had forked and that has not become another
/// program yet.
const CLAIM_OUTLIVES: Duration = Duration::from_secs(10);

/// Takes the data folder for this process, until the file is dropped or the process is gone, however it ends. The only
/// one that works on it empties what others may have left.
///
/// # Errors
/// If another process has it; nothing has been touched then.
pub fn claim(data_dir: &Path) -> anyhow::Result<File> {
    let path = data_dir.join(CLAIM);
    let failed = || format!("claiming the data folder by {}", path.display());
    let mut file = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(&path)
        .with_context(failed)?;
    let begun = Instant::now();
    loop {
        match file.try_lock() {
            Ok(()) => break,
            Err(TryLockError::Error(error)) => {
                let failed = failed();
                return Err(error).context(format!("{failed}; has its file system locks?"));
            }
            Err(TryLockError::WouldBlock) => {
                let holder = holder(&mut file);
                if holder.is_some_and(is_alive) || begun.elapsed() > CLAIM_OUTLIVES {
                    let holder = holder.map_or_else(
                        || "another process".to_owned(),
                        |id| format!("process {id}"),
                    );
                    bail!(
                        "the data folder {} is in use by {holder}: end that first, or name another folder with \
                         --data-dir",
                        data_dir.display()
                    );
                }
                thread::sleep(Duration::from_millis(50));
            }
        }
    }
    // A restore may have given the folder another name in between.
    let (locked, named) = (
        file.metadata().with_context(failed)?,
        fs::metadata(&path).with_context(failed)?,
    );
    if (locked.dev(), locked.ino()) != (named.dev(), named.ino()) {
        bail!(
            "the data folder {} was replaced just now; start again",
            data_dir.display()
        );
    }
    file.set_len(0)
        .and_then(|()| file.rewind())
        .and_then(|()| writeln!(file, "{}", std::process::id()))
        .with_context(failed)?;
    Ok(file)
}

/// Who says to have it. What holds is the lock; this helps to find whose it is.
fn holder(file: &mut File) -> Option<i32> {
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

/// Makes a private folder with nothing in it.
///
/// # Errors
/// If it cannot be emptied or made.
pub fn empty_folder(folder: &Path) -> anyhow::Result<()> {
    match fs::remove_dir_all(folder) {
        Ok(()) => {}
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
        Err(error) => {
            return Err(error).with_context(|| format!("emptying {}", folder.display()));
        }
    }
    private(folder)
}

/// Hash of the organiser's token; makes the token at the first start.
fn admin_token(data_dir: &Path) -> anyhow::Result<[u8; 32]> {
    let file = data_dir.join(ADMIN_TOKEN_FILE);
    match fs::read_to_string(&file) {
        Ok(token) if token.trim().is_empty() => bail!(
            "{} is empty; remove it, then the next start makes a new token",
            file.display()
        ),
        Ok(token) => return Ok(hash_token(token.trim())),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
        Err(error) => return Err(error).with_context(|| format!("reading {}", file.display())),
    }
    let token = Secret::generate(SecretKind::Admin).context("drawing the organiser's token")?;
    keep_secret(&file, token.as_str())?;
    tracing::info!(file = %file.display(), "made the organiser's token; keep the file secret");
    Ok(token.hash())
}

/// Writes a private file: beside and renamed, so that a crash cannot leave half a secret behind.
fn keep_secret(file: &Path, secret: &str) -> anyhow::Result<()> {
    let fresh = file.with_extension("new");
    let write = || -> std::io::Result<()> {
        let mut writer = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(0o600)
            .open(&fresh)?;
        writeln!(writer, "{secret}")?;
        writer.sync_all()?;
        fs::rename(&fresh, file)
    };
    write().with_context(|| format!("writing {}", file.display()))
}

/// What links are signed with; made at the first start, and again where it is lost: links that were made before are
/// worth nothing then.
///
/// # Errors
/// If it cannot be read or written, or is none.
pub fn link_key(data_dir: &Path) -> anyhow::Result<LinkKey> {
    let file = data_dir.join(LINK_KEY_FILE);
    match fs::read_to_string(&file) {
        Ok(text) => LinkKey::from_hex(text.trim()).with_context(|| {
            format!(
                "{}: expected 64 hexadecimal digits; remove it, then the next start makes another one",
                file.display()
            )
        }),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let key = LinkKey::generate().context("drawing the key of links")?;
            keep_secret(&file, &key.to_hex())?;
            Ok(key)
        }
        Err(error) => Err(error).with_context(|| format!("reading {}", file.display())),
    }
}

/// Has the store know the token in the file, or another one if that was revoked.
///
/// # Errors
/// If the file or the database cannot be read or written.
pub async fn set_admin_token(store: &Store, data_dir: &Path, now: Timestamp) -> anyhow::Result<()> {
    if !store.set_host_token(admin_token(data_dir)?, now).await? {
        let file = data_dir.join(ADMIN_TOKEN_FILE);
        tracing::warn!(file = %file.display(), "the token in the file was revoked; making another one");
        fs::remove_file(&file).with_context(|| format!("removing {}", file.display()))?;
        store.set_host_token(admin_token(data_dir)?, now).await?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_folder_is_claimed_by_one_until_it_lets_go() {
        let folder = tempfile::tempdir().unwrap();
        let claimed = claim(folder.path()).unwrap();
        let refused = claim(folder.path()).unwrap_err().to_string();
        let own = format!("in use by process {}", std::process::id());
        assert!(refused.contains(&own), "{refused}");
        drop(claimed);
        // A number of a process that is no more, and what no process writes.
        for left in ["999999999", "", "words"] {
            fs::write(folder.path().join(CLAIM), left).unwrap();
            drop(claim(folder.path()).unwrap());
        }
    }

    #[test]
    fn the_key_of_links_is_made_once_and_is_private() {
        let folder = tempfile::tempdir().unwrap();
        let first = link_key(folder.path()).unwrap().to_hex();
        assert_eq!(link_key(folder.path()).unwrap().to_hex(), first);
        let file = folder.path().join(LINK_KEY_FILE);
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        fs::write(&file, "no key\n").unwrap();
        let refused = link_key(folder.path()).unwrap_err().to_string();
        assert!(refused.contains("64 hexadecimal digits"), "{refused}");
    }

    #[test]
    fn the_organisers_token_is_made_once_and_is_private() {
        let folder = tempfile::tempdir().unwrap();
        let first = admin_token(folder.path()).unwrap();
        assert_eq!(admin_token(folder.path()).unwrap(), first);
        let file = folder.path().join(ADMIN_TOKEN_FILE);
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        let token = fs::read_to_string(&file).unwrap();
        assert!(token.starts_with("fo_admin_"));
        assert_eq!(hash_token(token.trim()), first);
        fs::write(&file, "\n").unwrap();
        assert!(
            admin_token(folder.path()).is_err(),
            "an empty token lets nobody in, or everybody"
        );
    }
}
