//! Memory that the server needs for a *bundle* (the archive with a team's agent) of the maximum size.

use crate::{CONFIG, Team};
use faceoff_tests::server::Server;
use reqwest::{Method, blocking::Body};
use serde_json::Value;
use std::{
    fs,
    io::{self, Read},
};

/// The maximum size of a bundle: the default of the setting `bundle.packed_bytes`.
const MAX_BUNDLE_BYTES: u64 = 512 << 20;
/// Additional memory that the server may need: a small part of a bundle.
const ADDITIONAL_BYTES: u64 = 64 << 20;

/// The first bytes of a gzip archive, then one block of noise, repeated: noise of the whole size would take longer to make than to send.
struct GeneratedBundle {
    sent_bytes: u64,
    block: Vec<u8>,
}

impl GeneratedBundle {
    const BLOCK_BYTES: usize = 1 << 20;
    const GZIP_HEADER: [u8; 4] = [0x1f, 0x8b, 8, 0];

    fn new() -> Self {
        // Knuth's linear congruential generator MMIX.
        let mut state = 1_u64;
        let noise = |_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            state.to_be_bytes()[0]
        };
        let mut block: Vec<u8> = (0..Self::BLOCK_BYTES).map(noise).collect();
        block[..Self::GZIP_HEADER.len()].copy_from_slice(&Self::GZIP_HEADER);
        Self {
            sent_bytes: 0,
            block,
        }
    }
}

impl Read for GeneratedBundle {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let remaining = usize::try_from(MAX_BUNDLE_BYTES - self.sent_bytes).unwrap_or(usize::MAX);
        let start = self.sent_bytes as usize % Self::BLOCK_BYTES;
        let length = buffer.len().min(remaining).min(Self::BLOCK_BYTES - start);
        buffer[..length].copy_from_slice(&self.block[start..start + length]);
        self.sent_bytes += length as u64;
        Ok(length)
    }
}

/// The server's peak memory so far, in bytes.
fn peak_bytes(server: &Server) -> u64 {
    let file = format!("/proc/{}/status", server.process_id());
    let status = fs::read_to_string(file).expect("the server runs");
    // Linux calls the peak of resident memory VmHWM.
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
    let bundle = GeneratedBundle::new();
    let answer = server
        .request(Method::POST, "/api/v1/submissions", &team.token)
        .header("content-type", "application/octet-stream")
        .body(Body::sized(bundle, MAX_BUNDLE_BYTES))
        .send()
        .expect("the server answers");
    assert_eq!(answer.status(), 201);
    let submission: Value = answer.json().expect("the API speaks JSON");
    let id = submission["id"].as_str().expect("a submission has an id");
    // The validation run reads the bundle, too, and rejects it: after the header of an archive it is only noise.
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
