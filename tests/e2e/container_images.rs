//! Container images as bundles (a bundle is what a team uploads): an image is uploaded, validated and scored like a folder of
//! files.

use crate::{
    Team, evaluation_path,
    kills::{assert_same, wait_for_outcome},
    start_day,
};
use faceoff_tests::{bundle, program, server::Server};
use flate2::{Compression, write::GzEncoder};
use serde_json::json;
use std::{
    fs,
    io::{self, Write as _},
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// A short evaluation of all three tasks, one job per task.
const CONFIG: &str = concat!(
    include_str!("../long_time_limits.toml"),
    r#"
[evaluation]
episodes_per_task = 4
episodes_per_shard = 4
[workers]
slots = 1
[sandbox]
resident_bytes = 0
"#
);

/// The paths of a program's shared libraries and of its dynamic loader.
fn libraries(program: &Path) -> Vec<PathBuf> {
    let output = Command::new("ldd").arg(program).output();
    let output = output.expect("ldd is part of the C library");
    let output = String::from_utf8(output.stdout).expect("its output is text");
    let paths = output.lines().filter_map(|line| {
        let path = line.split("=>").last()?.split_whitespace().next()?;
        path.starts_with('/').then(|| path.into())
    });
    paths.collect()
}

fn sha256(bytes: &[u8]) -> String {
    let mut process = Command::new("sha256sum")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("sha256sum is part of every system");
    let mut input = process.stdin.take().expect("its input is piped");
    let bytes = bytes.to_owned();
    let writer = std::thread::spawn(move || input.write_all(&bytes));
    let output = process.wait_with_output().expect("it ends");
    writer
        .join()
        .expect("the thread does not panic")
        .expect("sha256sum reads its input");
    // The digest has 64 digits; a file name follows.
    String::from_utf8_lossy(&output.stdout)[..64].to_owned()
}

/// An image as `docker save` writes it; each layer has these files, each with its name and content.
fn image_archive(layers: &[Vec<(String, Vec<u8>)>]) -> Vec<u8> {
    let mut image = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::fast()));
    let mut add = |name: &str, bytes: &[u8]| {
        append(&mut image, name, bytes).expect("writing to memory does not fail")
    };
    let (mut names, mut diff_ids) = (Vec::new(), Vec::new());
    for (number, files) in layers.iter().enumerate() {
        let mut layer = tar::Builder::new(Vec::new());
        for (name, bytes) in files {
            append(&mut layer, name, bytes).expect("writing to memory does not fail");
        }
        let layer = layer.into_inner().expect("writing to memory does not fail");
        names.push(format!("{number}/layer.tar"));
        diff_ids.push(format!("sha256:{}", sha256(&layer)));
        add(&names[number], &layer);
    }
    let architecture = match std::env::consts::ARCH {
        "x86_64" => "amd64",
        "aarch64" => "arm64",
        other => other,
    };
    let config = json!({
        "architecture": architecture, "os": "linux",
        "config": { "Env": ["PATH=/usr/bin"], "Cmd": ["/bin/bash"], "User": "root" },
        "rootfs": { "type": "layers", "diff_ids": diff_ids },
    });
    add("config.json", config.to_string().as_bytes());
    let manifest =
        json!([{ "Config": "config.json", "RepoTags": ["agent:latest"], "Layers": names }]);
    add("manifest.json", manifest.to_string().as_bytes());
    let encoder = image.into_inner().expect("writing to memory does not fail");
    encoder.finish().expect("writing to memory does not fail")
}

fn append<W: io::Write>(archive: &mut tar::Builder<W>, name: &str, bytes: &[u8]) -> io::Result<()> {
    let mut header = tar::Header::new_gnu();
    header.set_size(bytes.len() as u64);
    header.set_mode(0o755);
    archive.append_data(&mut header, name, bytes)
}

#[test]
fn image_and_bundle_of_same_program_get_same_score() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = bundle::example_agent("striker", scratch.path());
    let read = |path: &Path| fs::read(path).expect("it can be read");
    let path_in_image = |path: &Path| {
        path.display()
            .to_string()
            .trim_start_matches('/')
            .to_owned()
    };
    let library_layer = libraries(&program("striker"))
        .iter()
        .map(|path| (path_in_image(path), read(path)))
        .collect();
    let manifest = fs::read_to_string(folder.join("agent.toml")).expect("striker has one");
    assert!(manifest.contains("runtime = \"native\""), "{manifest}");
    let manifest = manifest.replace("runtime = \"native\"", "runtime = \"image\"");
    let agent_layer = vec![
        ("agent/agent.toml".to_owned(), manifest.into_bytes()),
        ("agent/striker".to_owned(), read(&folder.join("striker"))),
    ];
    let image = image_archive(&[library_layer, agent_layer]);

    // Both submissions are evaluated on the same day, so in the same episodes.
    let data = scratch.path().join("data");
    let server = Server::start(&data, CONFIG);
    let (files_team, image_team) = (
        Team::create(&server, "Files"),
        Team::create(&server, "Image"),
    );
    let files_submission = files_team.submit(&server, &folder);
    let image_id = image_team.upload(&server, image);
    let image_submission = image_team.verdict(&server, &image_id);
    assert_eq!(image_submission["state"], "valid", "{image_submission:#}");
    assert_eq!(image_submission["runtime"], "image", "{image_submission:#}");
    let day = start_day(&server);
    let [files_evaluation, image_evaluation] =
        [&files_submission, &image_submission].map(|submission| evaluation_path(&day, submission));
    // Datasets are released with the day, when all evaluations have ended.
    let _ = image_team.wait_until_finished(&server, &image_evaluation);
    let _ = files_team.wait_until_finished(&server, &files_evaluation);
    let files_outcome = wait_for_outcome(&server, &files_team, &files_evaluation);
    let image_outcome = wait_for_outcome(&server, &image_team, &image_evaluation);
    let episodes = assert_same(image_outcome, files_outcome);
    assert_eq!(episodes, 3 * 4, "three tasks of four episodes");

    // An image without an agent is invalid, and the reason shows what to write.
    let no_agent_id = image_team.upload(
        &server,
        image_archive(&[vec![(
            "usr/bin/true".to_owned(),
            read(Path::new("/bin/true")),
        )]]),
    );
    let refused = image_team.verdict(&server, &no_agent_id);
    assert_eq!(refused["state"], "invalid", "{refused:#}");
    let reason = refused["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("COPY . /agent"), "{reason}");
}
