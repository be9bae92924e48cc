//! Bundles as large as they may be: what they cost the server's memory.

use crate::{CONFIG, Team};
use faceoff_tests::server::Server;
use reqwest::{Method, blocking::Body};
use serde_json::Value;
use std::{
    fs,
    io::{self, Read},
};

/// `bundle.packed_bytes`, unless an organiser says otherwise.
const LARGEST_BYTES: u64 = 512 << 20;
/// What the server may need more than before, whatever comes: a small part of a bundle.
const MORE_BYTES: u64 = 64 << 20;

/// A gzip archive by its first bytes, and then noise that does not compress: made as it is sent.
struct Bundle {
    sent: u64,
    state: u64,
}

impl Read for Bundle {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = usize::try_from(LARGEST_BYTES - self.sent).unwrap_or(usize::MAX);
        let length = buffer.len().min(left);
        for (place, byte) in (self.sent..).zip(&mut buffer[..length]) {
            self.state = self
                .state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let noise = self.state.to_be_bytes()[0];
            *byte = *[0x1f, 0x8b, 8, 0].get(place as usize).unwrap_or(&noise);
        }
        self.sent += length as u64;
        Ok(length)
    }
}

/// The most memory that the server has had in use, bytes.
fn peak_bytes(server: &Server) -> u64 {
    let file = format!("/proc/{}/status", server.process_id());
    let status = fs::read_to_string(file).expect("the server runs");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.trim().strip_suffix(" kB"));
    1024 * kib
        .and_then(|kib| kib.parse::<u64>().ok())
        .expect("Linux tells it")
}

#[test]
fn the_largest_bundle_takes_a_small_part_of_its_size_in_memory() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(scratch.path(), CONFIG);
    let team = Team::create(&server, "Alpha");
    let before = peak_bytes(&server);
    let bundle = Bundle { sent: 0, state: 1 };
    let answer = server
        .request(Method::POST, "/api/v1/submissions", &team.token)
        .header("content-type", "application/octet-stream")
        .body(Body::sized(bundle, LARGEST_BYTES))
        .send()
        .expect("the server answers");
    assert_eq!(answer.status(), 201);
    let submission: Value = answer.json().expect("the API speaks JSON");
    let id = submission["id"].as_str().expect("a submission has an id");
    // It is looked into, too, and found to be none.
    let verdict = team.verdict(&server, id);
    assert_eq!(verdict["state"], "invalid", "{verdict:#}");
    let after = peak_bytes(&server);
    assert!(
        after < before + MORE_BYTES,
        "{} MiB before, {} MiB after",
        before >> 20,
        after >> 20
    );
}
