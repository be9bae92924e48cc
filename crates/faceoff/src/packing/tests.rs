use super::*;
use std::{
    fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::PathBuf,
};
use tempfile::TempDir;

fn folder(files: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        let file = folder.path().join(file);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(&file, file.as_os_str().len().to_string()).unwrap();
    }
    folder
}

fn names(folder: &Path) -> (Vec<String>, Vec<String>) {
    let found = Selection::of(folder).unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    (
        found.files().map(|(path, _)| text(path)).collect(),
        found.left_out().iter().map(|path| text(path)).collect(),
    )
}

#[test]
fn what_no_agent_needs_stays_out_unless_the_folder_says_otherwise() {
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
    ]);
    let (kept, left_out) = names(folder.path());
    assert_eq!(
        kept,
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
            "node_modules",
            "skills/__pycache__",
            "target"
        ]
    );
    let rules = "# what the server need not have\nnotes/\n!target/\n*.npz\n";
    fs::write(folder.path().join(IGNORE_FILE), rules).unwrap();
    let (kept, left_out) = names(folder.path());
    assert_eq!(
        kept,
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
fn a_folder_without_a_manifest_or_with_what_is_no_file_is_refused() {
    let refused = |folder: &TempDir| format!("{:#}", Selection::of(folder.path()).unwrap_err());
    let empty = folder(&["agent.py"]);
    assert!(refused(&empty).contains("there is no agent.toml"));
    let folder = folder(&["agent.toml"]);
    fs::write(folder.path().join(IGNORE_FILE), "*.toml\n").unwrap();
    assert!(refused(&folder).contains("leaves agent.toml out"));
    fs::write(folder.path().join(IGNORE_FILE), "a{b\n").unwrap();
    assert!(refused(&folder).contains("line 1"), "{}", refused(&folder));
    fs::remove_file(folder.path().join(IGNORE_FILE)).unwrap();
    let _socket = std::os::unix::net::UnixListener::bind(folder.path().join("socket")).unwrap();
    assert!(refused(&folder).contains("neither file nor folder nor link"));
}

fn packed(folder: &Path) -> Vec<u8> {
    let archive = tempfile::NamedTempFile::new().unwrap();
    Selection::of(folder)
        .unwrap()
        .pack(archive.reopen().unwrap())
        .unwrap();
    fs::read(archive.path()).unwrap()
}

#[test]
fn the_same_files_are_the_same_archive_whenever_and_by_whomever_they_were_made() {
    let files = ["agent.toml", "run", "a/b/c.txt"];
    let make = |time: u64| {
        let folder = folder(&files);
        // Names of one length, so that the contents agree.
        let place = folder.path();
        for file in files {
            fs::write(place.join(file), file).unwrap();
        }
        fs::set_permissions(
            place.join("run"),
            fs::Permissions::from_mode(0o700 | (time % 8) as u32),
        )
        .unwrap();
        symlink("a/b", place.join("link")).unwrap();
        fs::create_dir(place.join("empty")).unwrap();
        let at = std::time::UNIX_EPOCH + std::time::Duration::from_secs(time);
        fs::File::open(place.join("a/b/c.txt"))
            .unwrap()
            .set_modified(at)
            .unwrap();
        folder
    };
    let (one, other) = (make(1_000_000), make(2_000_005));
    let archive = packed(one.path());
    assert_eq!(archive, packed(other.path()));

    let unpacked = tempfile::tempdir().unwrap();
    tar::Archive::new(flate2::read::GzDecoder::new(&archive[..]))
        .unpack(unpacked.path())
        .unwrap();
    let at = |name: &str| unpacked.path().join(name);
    assert_eq!(fs::read_to_string(at("a/b/c.txt")).unwrap(), "a/b/c.txt");
    assert_eq!(fs::read_link(at("link")).unwrap(), PathBuf::from("a/b"));
    assert!(at("empty").is_dir());
    let mode = |name: &str| fs::metadata(at(name)).unwrap().permissions().mode() & 0o777;
    assert_eq!((mode("run"), mode("agent.toml")), (0o755, 0o644));
}
