//! `faceoff init`: the configuration file that it writes.

use crate::program::faceoff_in;
use std::fs;

#[test]
fn configuration_is_written_once_and_valid() {
    let folder = tempfile::tempdir().expect("a scratch folder can be made");
    let init = || faceoff_in(folder.path(), &["init"]);
    let first = init();
    assert!(first.status.success(), "{first:?}");
    let message = String::from_utf8_lossy(&first.stdout);
    assert!(message.contains("wrote faceoff.toml"), "{message}");

    let file = folder.path().join("faceoff.toml");
    let written = fs::read_to_string(&file).expect("it was written");
    fs::write(&file, format!("{written}\n# mine\n")).expect("it can be changed");
    let second = init();
    assert_eq!(second.status.code(), Some(1));
    let message = String::from_utf8_lossy(&second.stderr);
    assert!(
        message.contains("already exists and was not changed"),
        "{message}"
    );
    let content = fs::read_to_string(&file).expect("the file exists");
    assert!(content.ends_with("# mine\n"), "{content}");

    let doctor = |text: &str| {
        fs::write(&file, text).expect("it can be changed");
        faceoff_in(folder.path(), &["doctor", "--json"])
    };
    let valid = doctor(&written);
    let message = String::from_utf8_lossy(&valid.stderr);
    assert!(!message.contains("the configuration"), "{message}");
    let misspelled = doctor(&written.replace("episodes_per_task", "episodes_pre_task"));
    assert_eq!(misspelled.status.code(), Some(1));
    let message = String::from_utf8_lossy(&misspelled.stderr);
    assert!(
        message.contains("did you mean `episodes_per_task`?"),
        "{message}"
    );
}
