//! Help, completions and exit statuses of the program.

use crate::program::command;

/// Exit status, standard output and standard error.
fn faceoff(args: &[&str]) -> (Option<i32>, String, String) {
    let output = command(args).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (
        output.status.code(),
        text(output.stdout),
        text(output.stderr),
    )
}

/// The commands that a help text lists.
fn commands(help: &str) -> Vec<String> {
    let (_, listed) = help.split_once("\nCommands:\n").unwrap_or_default();
    listed
        .lines()
        .take_while(|line| !line.is_empty())
        // Continued descriptions are indented further.
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect()
}

#[test]
fn all_commands_have_a_help() {
    let mut pending: Vec<Vec<String>> = vec![Vec::new()];
    let mut checked = 0;
    while let Some(path) = pending.pop() {
        let mut args: Vec<&str> = path.iter().map(String::as_str).collect();
        args.push("--help");
        let (code, help, error) = faceoff(&args);
        assert_eq!(code, Some(0), "{path:?}: {error}");
        assert!(help.contains("Usage: faceoff"), "{path:?}: {help}");
        checked += 1;
        for command in commands(&help) {
            let mut path = path.clone();
            path.push(command);
            pending.push(path);
        }
    }
    assert!(checked > 100, "{checked} commands were found");
}

#[test]
fn completions_exist_for_all_shells() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let (code, script, error) = faceoff(&["completions", shell]);
        assert_eq!(code, Some(0), "{shell}: {error}");
        for word in ["faceoff", "submit", "like-server"] {
            assert!(
                script.contains(word),
                "{shell}: {word} is not in its script"
            );
        }
    }
    assert_eq!(faceoff(&["completions", "tcsh"]).0, Some(2));
}

#[test]
fn unreachable_server_ends_with_status_4() {
    let (code, out, error) = faceoff(&["board", "--server", "http://127.0.0.1:1", "--token", "x"]);
    assert_eq!((code, out.as_str()), (Some(4), ""), "{error}");
}
