use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

fn faceoff(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_faceoff"));
    let done = command.args(arguments).current_dir(folder).output();
    done.expect("the program can be started")
}

#[test]
fn a_configuration_is_written_once_and_serves_as_one() {
    let folder = tempfile::tempdir().expect("a scratch folder can be made");
    let init = || faceoff(folder.path(), &["init"]);
    let first = init();
    assert!(first.status.success(), "{first:?}");
    let told = String::from_utf8_lossy(&first.stdout);
    assert!(told.contains("wrote faceoff.toml"), "{told}");

    let file = folder.path().join("faceoff.toml");
    let written = fs::read_to_string(&file).expect("it was written");
    fs::write(&file, format!("{written}\n# mine\n")).expect("it can be changed");
    let again = init();
    assert_eq!(again.status.code(), Some(1));
    let told = String::from_utf8_lossy(&again.stderr);
    assert!(told.contains("exists and was left as it is"), "{told}");
    let kept = fs::read_to_string(&file).expect("it is there");
    assert!(kept.ends_with("# mine\n"), "{kept}");

    let doctor = |text: &str| {
        fs::write(&file, text).expect("it can be changed");
        faceoff(folder.path(), &["doctor", "--json"])
    };
    let found = doctor(&written);
    let told = String::from_utf8_lossy(&found.stderr);
    assert!(!told.contains("the configuration"), "{told}");
    let mistaken = doctor(&written.replace("episodes_per_task", "episodes_pre_task"));
    assert_eq!(mistaken.status.code(), Some(1));
    let told = String::from_utf8_lossy(&mistaken.stderr);
    assert!(told.contains("did you mean `episodes_per_task`?"), "{told}");
}
