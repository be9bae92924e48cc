//! Teams that live in containers: an agent that comes as an image is uploaded, tried and scored as any other.

use crate::path_of;
use crate::{
    Team,
    kills::{assert_same, outcome},
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

const CONFIG: &str = concat!(
    include_str!("../patient.toml"),
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

/// The shared libraries of a program, and what loads them, by the paths under which it looks for them.
fn libraries(program: &Path) -> Vec<PathBuf> {
    let told = Command::new("ldd").arg(program).output();
    let told = told.expect("ldd is there wherever programs are linked");
    let told = String::from_utf8(told.stdout).expect("its output is text");
    let paths = told.lines().filter_map(|line| {
        let place = line.split("=>").last()?.split_whitespace().next()?;
        place.starts_with('/').then(|| place.into())
    });
    paths.collect()
}

fn sha256(bytes: &[u8]) -> String {
    let mut hashing = Command::new("sha256sum")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("sha256sum is part of every system");
    let mut input = hashing.stdin.take().expect("its input is piped");
    let bytes = bytes.to_owned();
    let writing = std::thread::spawn(move || input.write_all(&bytes));
    let told = hashing.wait_with_output().expect("it ends");
    writing.join().expect("nobody panics").expect("it reads");
    String::from_utf8_lossy(&told.stdout)[..64].to_owned()
}

/// What `docker save` writes of an image whose layers hold these files.
fn saved(layers: &[Vec<(String, Vec<u8>)>]) -> Vec<u8> {
    let mut image = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::fast()));
    let mut add = |name: &str, bytes: &[u8]| append(&mut image, name, bytes).expect("memory");
    let (mut names, mut diff_ids) = (Vec::new(), Vec::new());
    for (number, files) in layers.iter().enumerate() {
        let mut layer = tar::Builder::new(Vec::new());
        for (name, bytes) in files {
            append(&mut layer, name, bytes).expect("memory takes it");
        }
        let layer = layer.into_inner().expect("memory takes it");
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
    let list = json!([{ "Config": "config.json", "RepoTags": ["ours:latest"], "Layers": names }]);
    add("manifest.json", list.to_string().as_bytes());
    let packed = image.into_inner().expect("memory takes it");
    packed.finish().expect("memory takes it")
}

fn append<W: io::Write>(into: &mut tar::Builder<W>, name: &str, bytes: &[u8]) -> io::Result<()> {
    let mut header = tar::Header::new_gnu();
    header.set_size(bytes.len() as u64);
    header.set_mode(0o755);
    into.append_data(&mut header, name, bytes)
}

#[test]
fn an_image_is_scored_as_the_same_program_in_a_bundle() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let folder = bundle::reference("striker", scratch.path());
    let read = |path: &Path| fs::read(path).expect("it can be read");
    let inside = |path: &Path| {
        path.display()
            .to_string()
            .trim_start_matches('/')
            .to_owned()
    };
    let base = libraries(&program("striker"))
        .iter()
        .map(|path| (inside(path), read(path)))
        .collect();
    let manifest = fs::read_to_string(folder.join("agent.toml")).expect("striker has one");
    assert!(manifest.contains("runtime = \"native\""), "{manifest}");
    let manifest = manifest.replace("runtime = \"native\"", "runtime = \"image\"");
    let own = vec![
        ("agent/agent.toml".to_owned(), manifest.into_bytes()),
        ("agent/striker".to_owned(), read(&folder.join("striker"))),
    ];
    let image = saved(&[base, own]);

    // The same server's seed for both.
    let data = scratch.path().join("data");
    let server = Server::start(&data, CONFIG);
    let (files, image_of) = (
        Team::create(&server, "Files"),
        Team::create(&server, "Image"),
    );
    let of_files = files.submit(&server, &folder);
    let uploaded = image_of.upload(&server, image);
    let of_image = image_of.verdict(&server, &uploaded);
    assert_eq!(of_image["state"], "valid", "{of_image:#}");
    assert_eq!(of_image["runtime"], "image", "{of_image:#}");
    let day = start_day(&server);
    let [of_files, of_image] = [&of_files, &of_image].map(|submission| path_of(&day, submission));
    // Datasets come out with the day, when all are over.
    let _ = image_of.finished(&server, &of_image);
    let _ = files.finished(&server, &of_files);
    let expected = outcome(&server, &files, &of_files);
    let found = outcome(&server, &image_of, &of_image);
    assert_eq!(assert_same(found, expected), 3 * 4);

    // An image without an agent is refused with what is to be written.
    let empty = image_of.upload(
        &server,
        saved(&[vec![(
            "usr/bin/true".to_owned(),
            read(Path::new("/bin/true")),
        )]]),
    );
    let refused = image_of.verdict(&server, &empty);
    assert_eq!(refused["state"], "invalid", "{refused:#}");
    let reason = refused["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("COPY . /agent"), "{reason}");
}
