//! The data folder, and the organiser's token in it.

use anyhow::{Context, bail};
use faceoff_http::token::{Secret, SecretKind, hash_token};
use faceoff_store::Store;
use jiff::Timestamp;
use std::{
    fs::{self, OpenOptions},
    io::Write as _,
    os::unix::fs::{DirBuilderExt, OpenOptionsExt},
    path::Path,
};

/// The file in the data folder that holds the organiser's token.
pub const ADMIN_TOKEN_FILE: &str = "admin-token";

/// Makes a folder that only its owner can read: it holds the season's secret and the teams' agents.
///
/// # Errors
/// If it cannot be made.
pub fn private_folder(folder: &Path) -> anyhow::Result<()> {
    fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
        .with_context(|| format!("making the folder {}", folder.display()))
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
    private_folder(folder)
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
    // Written beside and renamed, so that a crash cannot leave half a token behind.
    let fresh = data_dir.join(format!("{ADMIN_TOKEN_FILE}.new"));
    let write = || -> std::io::Result<()> {
        let mut writer = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(0o600)
            .open(&fresh)?;
        writeln!(writer, "{}", token.as_str())?;
        writer.sync_all()?;
        fs::rename(&fresh, &file)
    };
    write().with_context(|| format!("writing {}", file.display()))?;
    tracing::info!(file = %file.display(), "made the organiser's token; keep the file secret");
    Ok(token.hash())
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
