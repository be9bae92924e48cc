//! The program's commands, as people give them: what they print, and the status that they end with.

use faceoff_tests::{program, server::Server};
use serde_json::Value;
use std::{
    io::Write,
    path::Path,
    process::{Command, Stdio},
};

/// A refusal by what a command finds.
pub const FAILED: i32 = 1;
/// What the command line itself does not understand.
pub const MISUSED: i32 = 2;
/// A refusal by the server.
pub const REFUSED: i32 = 3;
/// The server does not answer.
pub const UNREACHABLE: i32 = 4;
/// The server knows no such token, or it is not enough.
pub const NOT_ALLOWED: i32 = 5;

/// A folder that there is not: nobody's logins, and not those of whoever runs the tests.
const NOWHERE: &str = "/nonexistent";

/// What a command has left.
pub struct Told {
    pub code: Option<i32>,
    out: String,
    err: String,
}

impl Told {
    /// Of one that did what was asked.
    #[track_caller]
    pub fn done(self) -> String {
        assert_eq!(self.code, Some(0), "{}{}", self.out, self.err);
        self.out
    }

    /// Of one that failed with this status, and may have printed before: standard error.
    #[track_caller]
    pub fn failed(self, code: i32) -> String {
        assert_eq!(self.code, Some(code), "{}{}", self.out, self.err);
        self.err
    }

    /// Of one that did, asked for JSON.
    #[track_caller]
    pub fn json(self) -> Value {
        serde_json::from_str(&self.done()).expect("--json prints JSON")
    }

    /// Of one that did nothing, with this status and these words on standard error.
    #[track_caller]
    pub fn not_done(self, code: i32, words: &[&str]) {
        assert_eq!(self.code, Some(code), "{}{}", self.out, self.err);
        assert_eq!(self.out, "", "what is not done prints nothing");
        for word in words {
            assert!(self.err.contains(word), "{word:?} is not in {:?}", self.err);
        }
    }
}

/// The program with these arguments, which reads `input`.
pub fn faceoff(args: &[&str], input: &str) -> Told {
    faceoff_of(Path::new(NOWHERE), args, input)
}

/// The same, of somebody whose logins are kept in this folder.
pub fn faceoff_of(config_home: &Path, args: &[&str], input: &str) -> Told {
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
    // Who reads nothing has gone already.
    let _ = stdin.write_all(input.as_bytes());
    drop(stdin);
    let output = child.wait_with_output().expect("a child can be reaped");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("a command prints text");
    Told {
        code: output.status.code(),
        out: text(output.stdout),
        err: text(output.stderr),
    }
}

/// `faceoff admin` with a token.
pub fn admin_as(server: &Server, token: &str, args: &[&str]) -> Told {
    let who = ["admin", "--server", &server.url, "--token", token];
    faceoff(&[&who[..], args].concat(), "")
}

/// `faceoff admin` with the host's token.
pub fn admin(server: &Server, args: &[&str]) -> Told {
    admin_as(server, &server.admin_token, args)
}

/// A command of teams and their people, with a token.
pub fn member(server: &Server, token: &str, command: &str, args: &[&str]) -> Told {
    let who = [command, "--server", &server.url, "--token", token];
    faceoff(&[&who[..], args].concat(), "")
}
