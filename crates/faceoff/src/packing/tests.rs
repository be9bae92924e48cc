//! Which files are packed into a bundle, and the bytes of its archive.

use super::*;
use std::{
    fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::PathBuf,
};
use tempfile::TempDir;

/// Creates a folder with these files; the content of each is the length of its path.
fn folder(files: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        let file = folder.path().join(file);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(&file, file.as_os_str().len().to_string()).unwrap();
    }
    folder
}

/// The names of the packed files, and of those that are left out.
fn names(folder: &Path) -> (Vec<String>, Vec<String>) {
    let selection = Selection::read(folder).unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    (
        selection.files().map(|(path, _)| text(path)).collect(),
        selection.left_out().iter().map(|path| text(path)).collect(),
    )
}

#[test]
fn default_rules_apply_unless_overridden() {
    let folder = folder(&[
        "agent.toml",
        "agent.py",
        "skills/hit.py",
        "skills/__pycache__/hit.cpython-311.pyc",
        ".git/HEAD",
        ".venv/bin/python",
        "target/debug/agent",
        "models/target/weights.npz",
        "node_modules/a/b.js",
        "notes/plan.md",
        "agent.py~",
        ".DS_Store",
        "skills/._hit.py",
        "desktop.ini",
    ]);
    let (packed, left_out) = names(folder.path());
    assert_eq!(
        packed,
        [
            "agent.py",
            "agent.toml",
            "models/target/weights.npz",
            "notes/plan.md",
            "skills/hit.py"
        ]
    );
    assert_eq!(
        left_out,
        [
            ".DS_Store",
            ".git",
            ".venv",
            "agent.py~",
            "desktop.ini",
            "node_modules",
            "skills/._hit.py",
            "skills/__pycache__",
            "target"
        ]
    );
    // An editor of Windows has written it.
    let rules = "\u{feff}notes/\r\n# not needed on the server\r\n!target/\r\n*.npz\r\n";
    fs::write(folder.path().join(IGNORE_FILE), rules).unwrap();
    let (packed, left_out) = names(folder.path());
    assert_eq!(
        packed,
        [
            "agent.py",
            "agent.toml",
            "skills/hit.py",
            "target/debug/agent"
        ]
    );
    assert!(
        left_out.contains(&"models/target/weights.npz".to_owned())
            && left_out.contains(&"notes".to_owned())
    );
    assert!(!left_out.contains(&"target".to_owned()));
}

#[test]
fn folder_without_manifest_or_with_a_socket_is_refused() {
    let refused = |folder: &TempDir| format!("{:#}", Selection::read(folder.path()).unwrap_err());
    let empty = folder(&["agent.py"]);
    assert!(refused(&empty).contains("there is no agent.toml"));
    let folder = folder(&["agent.toml"]);
    fs::write(folder.path().join(IGNORE_FILE), "*.toml\n").unwrap();
    assert!(refused(&folder).contains("leaves out agent.toml"));
    fs::write(folder.path().join(IGNORE_FILE), "a{b\n").unwrap();
    assert!(refused(&folder).contains("line 1"), "{}", refused(&folder));
    fs::remove_file(folder.path().join(IGNORE_FILE)).unwrap();
    let _socket = std::os::unix::net::UnixListener::bind(folder.path().join("socket")).unwrap();
    assert!(refused(&folder).contains("neither file, folder nor link"));
}

fn pack(folder: &Path) -> Vec<u8> {
    let archive = tempfile::NamedTempFile::new().unwrap();
    Selection::read(folder)
        .unwrap()
        .pack(archive.reopen().unwrap())
        .unwrap();
    fs::read(archive.path()).unwrap()
}

#[test]
fn archive_depends_only_on_the_files() {
    let files = ["agent.toml", "run", "a/b/c.txt"];
    // Two folders with the same files, but other times and permissions.
    let make_folder = |time_s: u64| {
        let folder = folder(&files);
        let root = folder.path();
        for file in files {
            fs::write(root.join(file), file).unwrap();
        }
        fs::set_permissions(
            root.join("run"),
            fs::Permissions::from_mode(0o700 | (time_s % 8) as u32),
        )
        .unwrap();
        symlink("a/b", root.join("link")).unwrap();
        fs::create_dir(root.join("empty")).unwrap();
        let modified = std::time::UNIX_EPOCH + std::time::Duration::from_secs(time_s);
        fs::File::open(root.join("a/b/c.txt"))
            .unwrap()
            .set_modified(modified)
            .unwrap();
        folder
    };
    let (one, other) = (make_folder(1_000_000), make_folder(2_000_005));
    let archive = pack(one.path());
    assert_eq!(archive, pack(other.path()));

    let unpacked = tempfile::tempdir().unwrap();
    tar::Archive::new(flate2::read::GzDecoder::new(&archive[..]))
        .unpack(unpacked.path())
        .unwrap();
    let path = |name: &str| unpacked.path().join(name);
    assert_eq!(fs::read_to_string(path("a/b/c.txt")).unwrap(), "a/b/c.txt");
    assert_eq!(fs::read_link(path("link")).unwrap(), PathBuf::from("a/b"));
    assert!(path("empty").is_dir());
    let mode = |name: &str| fs::metadata(path(name)).unwrap().permissions().mode() & 0o777;
    assert_eq!((mode("run"), mode("agent.toml")), (0o755, 0o644));
}
