//! Memory that the server needs for a bundle of the maximum size.

use crate::{CONFIG, Team};
use faceoff_tests::server::Server;
use reqwest::{Method, blocking::Body};
use serde_json::Value;
use std::{
    fs,
    io::{self, Read},
};

/// The default of `bundle.packed_bytes`.
const LARGEST_BYTES: u64 = 512 << 20;
/// Additional memory that the server may need: a small part of a bundle.
const ADDITIONAL_BYTES: u64 = 64 << 20;

/// The first bytes of a gzip archive, then noise that does not compress, generated while it is sent.
struct GeneratedBundle {
    sent: u64,
    state: u64,
}

impl Read for GeneratedBundle {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = usize::try_from(LARGEST_BYTES - self.sent).unwrap_or(usize::MAX);
        let length = buffer.len().min(left);
        for (index, byte) in (self.sent..).zip(&mut buffer[..length]) {
            self.state = self
                .state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let noise = self.state.to_be_bytes()[0];
            *byte = *[0x1f, 0x8b, 8, 0].get(index as usize).unwrap_or(&noise);
        }
        self.sent += length as u64;
        Ok(length)
    }
}

/// The server's peak memory so far, in bytes.
fn peak_bytes(server: &Server) -> u64 {
    let file = format!("/proc/{}/status", server.process_id());
    let status = fs::read_to_string(file).expect("the server runs");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.trim().strip_suffix(" kB"));
    1024 * kib
        .and_then(|kib| kib.parse::<u64>().ok())
        .expect("Linux reports the peak")
}

#[test]
fn largest_bundle_needs_small_part_of_its_size_in_memory() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(scratch.path(), CONFIG);
    let team = Team::create(&server, "Alpha");
    let before = peak_bytes(&server);
    let bundle = GeneratedBundle { sent: 0, state: 1 };
    let answer = server
        .request(Method::POST, "/api/v1/submissions", &team.token)
        .header("content-type", "application/octet-stream")
        .body(Body::sized(bundle, LARGEST_BYTES))
        .send()
        .expect("the server answers");
    assert_eq!(answer.status(), 201);
    let submission: Value = answer.json().expect("the API speaks JSON");
    let id = submission["id"].as_str().expect("a submission has an id");
    // The validation run reads it, too, and finds no archive.
    let verdict = team.verdict(&server, id);
    assert_eq!(verdict["state"], "invalid", "{verdict:#}");
    let after = peak_bytes(&server);
    assert!(
        after < before + ADDITIONAL_BYTES,
        "{} MiB before, {} MiB after",
        before >> 20,
        after >> 20
    );
}
