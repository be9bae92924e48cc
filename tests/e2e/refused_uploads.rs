//! Refusals of large uploads, as common HTTP clients see them. Each must show the server's error message, and no broken
//! connection.

use crate::{
    CONFIG, Team,
    commands::{self, REFUSED},
};
use faceoff_tests::server::Server;
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Size of the uploaded file.
const UPLOAD_BYTES: u64 = 200 << 20;
/// The server's limit of a bundle (the archive with a team's agent), and of the bundles of a team and day.
const MAX_BYTES: u64 = 100 << 20;

/// A request that uploads a file and prints the status and the body of the response.
const PYTHON: &str = "
import sys, urllib.error, urllib.request
url, token, media_type, file = sys.argv[1:]
headers = {'Content-Type': media_type, 'Authorization': 'Bearer ' + token}
data = open(file, 'rb').read()
try:
    urllib.request.urlopen(urllib.request.Request(url, data, headers))
except urllib.error.HTTPError as error:
    print(error.code, error.read().decode())
";

/// The same for Node.
const NODE: &str = "
const [url, token, media_type, file] = process.argv.slice(1);
const headers = { 'Content-Type': media_type, 'Authorization': 'Bearer ' + token };
const body = require('fs').readFileSync(file);
fetch(url, { method: 'POST', headers, body }).then(async (response) => {
    console.log(response.status, await response.text());
});
";

/// An HTTP client that uploads a file.
#[derive(Debug, Clone, Copy)]
enum HttpClient {
    Curl,
    /// curl that does not ask with `Expect: 100-continue` whether it may send.
    EagerCurl,
    Python,
    Node,
}

impl HttpClient {
    const ALL: [Self; 4] = [Self::Curl, Self::EagerCurl, Self::Python, Self::Node];

    /// The output of the client, which must succeed.
    fn upload(self, server: &Server, token: &str, media_type: &str, file: &Path) -> String {
        let url = format!("{}/api/v1/submissions", server.url);
        let file = file.to_str().expect("a scratch path is text");
        let command = match self {
            Self::Curl | Self::EagerCurl => {
                let mut curl = Command::new("curl");
                curl.args(["--silent", "--show-error", "--noproxy", "*"])
                    .args(["--write-out", "%{http_code}"])
                    .args(["--data-binary", &format!("@{file}")])
                    .args(["--header", &format!("Content-Type: {media_type}")])
                    .args(["--header", &format!("Authorization: Bearer {token}")]);
                if matches!(self, Self::EagerCurl) {
                    curl.args(["--header", "Expect:"]);
                }
                curl.arg(&url);
                curl
            }
            Self::Python => {
                return upload_by_python(&url, (token, media_type), Path::new(file), &[]);
            }
            Self::Node => {
                let mut node = Command::new("node");
                node.args(["-e", NODE, &url, token, media_type, file]);
                node
            }
        };
        output_of(command)
    }
}

/// The output of a Python program that uploads a file, with these environment variables: the status and body of a refusal.
pub fn upload_by_python(
    url: &str,
    (token, media_type): (&str, &str),
    file: &Path,
    variables: &[(&str, PathBuf)],
) -> String {
    let mut python = Command::new("python3");
    python
        .args(["-c", PYTHON, url, token, media_type])
        .arg(file)
        .envs(variables.iter().map(|(name, value)| (*name, value)));
    output_of(python)
}

/// The standard output of a program that must succeed.
fn output_of(mut command: Command) -> String {
    let output = command.output().expect("docker/setup.sh installs it");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A large file of zeros, which is no archive.
pub fn large_file(folder: &Path) -> PathBuf {
    let path = folder.join("agent.tar.gz");
    let file = fs::File::create(&path).expect("a scratch file can be made");
    file.set_len(UPLOAD_BYTES)
        .expect("a sparse file needs no space");
    path
}

#[test]
fn clients_show_refusals_of_large_uploads() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = format!("{CONFIG}\n[bundle]\npacked_bytes = {MAX_BYTES}\n");
    let server = Server::start(&scratch.path().join("data"), &config);
    let token = &Team::create(&server, "Alpha").token;
    let file = large_file(scratch.path());
    let (bundle, form) = ("application/octet-stream", "multipart/form-data");
    for client in HttpClient::ALL {
        for (token, media_type, status, slug) in [
            ("fo_unknown", bundle, "401", "unauthenticated"),
            (token, bundle, "413", "too-large"),
            (token, form, "415", "unsupported-media-type"),
        ] {
            let output = client.upload(&server, token, media_type, &file);
            assert!(output.contains(status), "{client:?}: {output}");
            assert!(output.contains(slug), "{client:?}: {output}");
        }
    }
}

#[test]
fn command_line_shows_refusal_of_large_upload() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = format!("{CONFIG}\n[uploads]\nday_bytes = {MAX_BYTES}\n");
    let server = Server::start(&scratch.path().join("data"), &config);
    let team = Team::create(&server, "Alpha");
    let file = large_file(scratch.path());
    let file = file.to_str().expect("a scratch path is text");
    let output = commands::member(&server, &team.token, "submit", &[file]);
    let error = output.expect_failure(REFUSED);
    assert!(error.contains(&MAX_BYTES.to_string()), "{error}");
}
