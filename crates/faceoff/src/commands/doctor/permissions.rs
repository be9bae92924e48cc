//! Checks that only the server's user can access the data folder.

use super::{super::serve::ADMIN_TOKEN_FILE, check::Check};
use std::{
    fs::{self, Metadata},
    io::ErrorKind,
    os::unix::fs::{MetadataExt, PermissionsExt},
    path::Path,
};

/// Permission bits of the group and of other users.
const GROUP_AND_OTHERS: u32 = 0o077;

/// Checks owner and mode of the data folder and its secrets, for a server that runs as the current user.
pub fn permissions(data_dir: &Path) -> Check {
    let own_uid = rustix::process::geteuid().as_raw();
    let mut problems = Vec::new();
    // The empty name stands for the folder itself.
    for name in ["", ADMIN_TOKEN_FILE, "faceoff.sqlite3"] {
        let path = if name.is_empty() {
            data_dir.to_owned()
        } else {
            data_dir.join(name)
        };
        match fs::metadata(&path) {
            Ok(found) => problems.extend(find_problem(&path, &found, own_uid)),
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => problems.push((
                format!("{}: {error}", path.display()),
                "run faceoff doctor as the server's user".to_owned(),
            )),
        }
    }
    if problems.is_empty() {
        let found = match data_dir.exists() {
            true => format!("{} is accessible to its owner only", data_dir.display()),
            false => format!(
                "{} does not exist yet; it will be accessible to its owner only",
                data_dir.display()
            ),
        };
        return Check {
            name: "permissions",
            found,
            fix: None,
        };
    }
    let (found, fixes): (Vec<_>, Vec<_>) = problems.into_iter().unzip();
    Check {
        name: "permissions",
        found: found.join("; "),
        fix: Some(fixes.join("; ")),
    }
}

/// The problem of a file or folder, and its fix.
fn find_problem(path: &Path, metadata: &Metadata, own_uid: u32) -> Option<(String, String)> {
    let shown = path.display();
    if own_uid != 0 && metadata.uid() != own_uid {
        return Some((
            format!(
                "{shown} belongs to user {}, this is user {own_uid}",
                metadata.uid()
            ),
            format!("run the server as that user, or chown -R {own_uid} {shown}"),
        ));
    }
    let mode = metadata.permissions().mode() & 0o777;
    // The mode of the folder protects its files; only the token is protected a second time.
    let is_open = mode & GROUP_AND_OTHERS != 0 && !path.ends_with("faceoff.sqlite3");
    is_open.then(|| {
        (
            format!("{shown} has mode {mode:04o}: other users can read it"),
            format!("chmod go= {shown}"),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::Permissions;

    #[test]
    fn folder_or_token_readable_by_others_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("data");
        assert_eq!(
            permissions(&data).fix,
            None,
            "a missing folder is no problem"
        );
        fs::create_dir(&data).unwrap();
        fs::set_permissions(&data, Permissions::from_mode(0o700)).unwrap();
        fs::write(data.join(ADMIN_TOKEN_FILE), "").unwrap();
        fs::set_permissions(data.join(ADMIN_TOKEN_FILE), Permissions::from_mode(0o644)).unwrap();
        let found = permissions(&data);
        assert!(
            found.found.contains("admin-token has mode 0644"),
            "{found:?}"
        );
        assert!(found.fix.unwrap().contains("chmod go= "));
        fs::set_permissions(data.join(ADMIN_TOKEN_FILE), Permissions::from_mode(0o600)).unwrap();
        assert_eq!(permissions(&data).fix, None);
        fs::set_permissions(&data, Permissions::from_mode(0o755)).unwrap();
        assert!(permissions(&data).found.contains("mode 0755"));
    }

    #[test]
    fn folder_of_another_user_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let metadata = fs::metadata(folder.path()).unwrap();
        let (found, fix) = find_problem(folder.path(), &metadata, metadata.uid() + 1).unwrap();
        assert!(found.contains("belongs to user"), "{found}");
        assert!(fix.contains("chown"), "{fix}");
    }
}
