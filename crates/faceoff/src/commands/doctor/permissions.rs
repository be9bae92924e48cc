//! Who may read and write what the server keeps.

use super::{super::serve::ADMIN_TOKEN_FILE, checked::Checked};
use std::{
    fs::{self, Metadata},
    io::ErrorKind,
    os::unix::fs::{MetadataExt, PermissionsExt},
    path::Path,
};

/// Nobody but the owner.
const OTHERS: u32 = 0o077;

/// The data folder and the secrets in it, as they would be for the user that asks.
pub fn permissions(data_dir: &Path) -> Checked {
    let own = rustix::process::geteuid().as_raw();
    let mut wrong = Vec::new();
    for name in ["", ADMIN_TOKEN_FILE, "faceoff.sqlite3"] {
        let path = if name.is_empty() {
            data_dir.to_owned()
        } else {
            data_dir.join(name)
        };
        match fs::metadata(&path) {
            Ok(found) => wrong.extend(judged(&path, &found, own)),
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => wrong.push((
                format!("{}: {error}", path.display()),
                "run this as the user that serves".to_owned(),
            )),
        }
    }
    if wrong.is_empty() {
        let found = match data_dir.exists() {
            true => format!("{} is its owner's alone", data_dir.display()),
            false => format!(
                "{} is not there yet; it will be its owner's alone",
                data_dir.display()
            ),
        };
        return Checked {
            name: "permissions",
            found,
            cure: None,
        };
    }
    let (found, cures): (Vec<_>, Vec<_>) = wrong.into_iter().unzip();
    Checked {
        name: "permissions",
        found: found.join("; "),
        cure: Some(cures.join("; ")),
    }
}

/// What is wrong with a file or folder, and the cure.
fn judged(path: &Path, found: &Metadata, own: u32) -> Option<(String, String)> {
    let shown = path.display();
    if own != 0 && found.uid() != own {
        return Some((
            format!(
                "{shown} belongs to user {}, this is user {own}",
                found.uid()
            ),
            format!("serve as that user, or chown -R {own} {shown}"),
        ));
    }
    let mode = found.permissions().mode() & 0o777;
    // The files lie in the folder, whose own mode keeps others out; the token is worth a second door.
    let is_open = mode & OTHERS != 0 && !path.ends_with("faceoff.sqlite3");
    is_open.then(|| {
        (
            format!("{shown} has mode {mode:04o}: others may look into it"),
            format!("chmod go= {shown}"),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::Permissions;

    #[test]
    fn a_folder_or_token_that_others_can_read_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("data");
        assert_eq!(
            permissions(&data).cure,
            None,
            "what is not there is no fault"
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
        assert!(found.cure.unwrap().contains("chmod go= "));
        fs::set_permissions(data.join(ADMIN_TOKEN_FILE), Permissions::from_mode(0o600)).unwrap();
        assert_eq!(permissions(&data).cure, None);
        fs::set_permissions(&data, Permissions::from_mode(0o755)).unwrap();
        assert!(permissions(&data).found.contains("mode 0755"));
    }

    #[test]
    fn what_belongs_to_another_user_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let found = fs::metadata(folder.path()).unwrap();
        let (words, cure) = judged(folder.path(), &found, found.uid() + 1).unwrap();
        assert!(words.contains("belongs to user"), "{words}");
        assert!(cure.contains("chown"), "{cure}");
    }
}
