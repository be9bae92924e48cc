//! Helpers that run commands of the program `faceoff` as users do, and check their output and exit status.

use faceoff_tests::{program, server::Server};
use serde_json::Value;
use std::{
    io::Write,
    path::Path,
    process::{Command, Stdio},
};

/// Exit status: the command failed.
pub const FAILED: i32 = 1;
/// Exit status: the command line is invalid.
pub const USAGE_ERROR: i32 = 2;
/// Exit status: the server refused the request.
pub const REFUSED: i32 = 3;
/// Exit status: the server does not answer.
pub const UNREACHABLE: i32 = 4;
/// Exit status: the token is missing, unknown or without the required permission.
pub const NOT_ALLOWED: i32 = 5;

/// A folder that does not exist, so that commands do not use the stored logins of the user who runs the tests.
const NO_CONFIG_HOME: &str = "/nonexistent";

/// Exit status, standard output and standard error of a command.
pub struct CommandOutput {
    pub code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl CommandOutput {
    /// Standard output of a command that must succeed.
    #[track_caller]
    pub fn expect_success(self) -> String {
        assert_eq!(self.code, Some(0), "{}{}", self.stdout, self.stderr);
        self.stdout
    }

    /// Standard error of a command that must fail with this status. It may have printed output before.
    #[track_caller]
    pub fn expect_failure(self, code: i32) -> String {
        assert_eq!(self.code, Some(code), "{}{}", self.stdout, self.stderr);
        self.stderr
    }

    /// Standard output and standard error of a command with any status.
    pub fn text(self) -> String {
        self.stdout + &self.stderr
    }

    /// Standard output, as JSON, of a command that must succeed.
    #[track_caller]
    pub fn json(self) -> Value {
        serde_json::from_str(&self.expect_success()).expect("--json prints JSON")
    }

    /// The command must fail with this status, print nothing to standard output, and print these words to standard error.
    #[track_caller]
    pub fn expect_refusal(self, code: i32, words: &[&str]) {
        assert_eq!(self.code, Some(code), "{}{}", self.stdout, self.stderr);
        assert_eq!(self.stdout, "", "a refused command prints no output");
        for word in words {
            assert!(
                self.stderr.contains(word),
                "{word:?} is not in {:?}",
                self.stderr
            );
        }
    }
}

/// Runs the program with these arguments and this standard input.
pub fn faceoff(args: &[&str], input: &str) -> CommandOutput {
    faceoff_with_home(Path::new(NO_CONFIG_HOME), args, input)
}

/// Runs the program with the logins that are stored in the folder `config_home`.
pub fn faceoff_with_home(config_home: &Path, args: &[&str], input: &str) -> CommandOutput {
    let mut child = Command::new(program("faceoff"))
        .args(args)
        .env_remove("FACEOFF_TOKEN")
        .env_remove("FACEOFF_ADMIN_TOKEN")
        .env_remove("FACEOFF_SERVER")
        .env_remove("FACEOFF_CA_FILE")
        .env("XDG_CONFIG_HOME", config_home)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program can be started");
    let mut stdin = child.stdin.take().expect("standard input is piped");
    // A command that reads no input may have ended already.
    let _ = stdin.write_all(input.as_bytes());
    drop(stdin);
    let output = child.wait_with_output().expect("a child can be reaped");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("a command prints text");
    CommandOutput {
        code: output.status.code(),
        stdout: text(output.stdout),
        stderr: text(output.stderr),
    }
}

/// `faceoff admin` with a token.
pub fn admin_as(server: &Server, token: &str, args: &[&str]) -> CommandOutput {
    let options = ["admin", "--server", &server.url, "--token", token];
    faceoff(&[&options[..], args].concat(), "")
}

/// `faceoff admin` with the operator's token.
pub fn admin(server: &Server, args: &[&str]) -> CommandOutput {
    admin_as(server, &server.admin_token, args)
}

/// Arguments of `faceoff join`, which accepts an invitation.
pub fn join_args<'a>(server: &'a Server, link: &'a str, options: &[&'a str]) -> Vec<&'a str> {
    [&["join", link, "--server", &server.url], options].concat()
}

/// A command that team members use, with a token.
pub fn member(server: &Server, token: &str, command: &str, args: &[&str]) -> CommandOutput {
    let options = [command, "--server", &server.url, "--token", token];
    faceoff(&[&options[..], args].concat(), "")
}
