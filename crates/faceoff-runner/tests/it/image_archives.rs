//! Builder of container images, valid and malicious.

use crate::archives::Tar;
use flate2::{Compression, write::GzEncoder};
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};
use std::io::{Cursor, Write};

/// A valid `agent.toml` of a container image.
pub const IMAGE_MANIFEST: &str = "name = \"boxed\"\ncommand = [\"./agent\"]\nruntime = \"image\"\n";

/// `sha256:` and the digits of the hash.
pub fn digest(bytes: &[u8]) -> String {
    format!("sha256:{}", hex::encode(Sha256::digest(bytes)))
}

/// The path of a blob (a document or a layer) in an OCI layout.
fn blob_path(digest: &str) -> String {
    format!("blobs/{}", digest.replace(':', "/"))
}

/// A folder of the host whose path can also exist in an image. It is not below `/tmp`, which is empty in an image,
/// and not below the target folder, which may be there.
pub fn host_folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/var/tmp").unwrap()
}

/// Compression of a layer in the archive.
#[derive(Debug, Clone, Copy)]
pub enum Packing {
    Plain,
    Gzip,
    Zstd,
}

/// Builder of an image.
pub struct TestImage {
    layers: Vec<Vec<u8>>,
    packing: Packing,
    config: Value,
}

impl TestImage {
    /// An image of these layers, the lowest one first, for this host.
    pub fn new(layers: impl IntoIterator<Item = Tar>) -> Self {
        let architecture = match std::env::consts::ARCH {
            "x86_64" => "amd64",
            "aarch64" => "arm64",
            other => other,
        };
        let layers: Vec<Vec<u8>> = layers.into_iter().map(Tar::bytes).collect();
        let diff_ids: Vec<String> = layers.iter().map(|layer| digest(layer)).collect();
        let config = json!({
            "architecture": architecture,
            "os": "linux",
            "config": {"Env": ["PATH=/opt/bin:/bin", "MODE=fast"], "Entrypoint": ["/none"], "User": "root"},
            "rootfs": {"type": "layers", "diff_ids": diff_ids},
            "history": [{"created_by": "COPY . /agent"}],
        });
        Self {
            layers,
            packing: Packing::Plain,
            config,
        }
    }

    /// An image with a lowest layer that contains an agent.
    pub fn agent(layers: impl IntoIterator<Item = Tar>) -> Self {
        Self::new([agent_layer()].into_iter().chain(layers))
    }

    /// Sets the compression of the layers.
    pub fn packed(mut self, packing: Packing) -> Self {
        self.packing = packing;
        self
    }

    /// Changes the image's configuration.
    pub fn config(mut self, change: impl FnOnce(&mut Value)) -> Self {
        change(&mut self.config);
        self
    }

    pub fn config_bytes(&self) -> Vec<u8> {
        self.config.to_string().into_bytes()
    }

    /// The layers as they are in the archive.
    pub fn packed_layers(&self) -> Vec<Vec<u8>> {
        let pack = |layer: &Vec<u8>| match self.packing {
            Packing::Plain => layer.clone(),
            Packing::Gzip => {
                let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
                encoder.write_all(layer).unwrap();
                encoder.finish().unwrap()
            }
            Packing::Zstd => zstd::encode_all(Cursor::new(layer), 1).unwrap(),
        };
        self.layers.iter().map(pack).collect()
    }

    /// The image in the format of older versions of Docker: layers in folders, the list of images last.
    pub fn docker(&self) -> Tar {
        let names: Vec<String> = (0..self.layers.len())
            .map(|index| format!("layer{index}/layer.tar"))
            .collect();
        let layers = self.packed_layers();
        let tar = Tar::new().file("config.json", 0o644, &self.config_bytes());
        let tar = names
            .iter()
            .zip(&layers)
            .fold(tar, |tar, (name, layer)| tar.file(name, 0o644, layer));
        tar.file(
            "manifest.json",
            0o644,
            &json_bytes(&json!([{
                "Config": "config.json", "RepoTags": ["ours:latest", "ours:1"], "Layers": names,
            }])),
        )
    }

    /// Adds the image's blobs to `tar`. Also returns the descriptor of the image's manifest, for an index.
    pub fn blobs(&self, tar: Tar) -> (Tar, Value) {
        let layers = self.packed_layers();
        let config = self.config_bytes();
        let manifest = json!({
            "schemaVersion": 2,
            "config": {"mediaType": "application/vnd.oci.image.config.v1+json", "digest": digest(&config), "size": 1},
            "layers": layers.iter().map(|layer| json!({"digest": digest(layer), "size": 1})).collect::<Vec<_>>(),
        });
        let manifest = json_bytes(&manifest);
        let mut tar = tar.file(&blob_path(&digest(&config)), 0o644, &config).file(
            &blob_path(&digest(&manifest)),
            0o644,
            &manifest,
        );
        let mut seen = Vec::new();
        for layer in &layers {
            if !seen.contains(&digest(layer)) {
                seen.push(digest(layer));
                tar = tar.file(&blob_path(&digest(layer)), 0o644, layer);
            }
        }
        let descriptor = json!({
            "mediaType": "application/vnd.oci.image.manifest.v1+json", "digest": digest(&manifest), "size": 1,
        });
        (tar, descriptor)
    }

    /// The image in the OCI layout (the format of the Open Container Initiative).
    pub fn layout(&self) -> Tar {
        let (tar, descriptor) = self.blobs(empty_layout());
        with_index(tar, &[descriptor])
    }
}

/// An OCI layout without images: only its marker file.
pub fn empty_layout() -> Tar {
    Tar::new().file("oci-layout", 0o644, b"{\"imageLayoutVersion\":\"1.0.0\"}")
}

/// Adds the index of an OCI layout, which lists these images.
pub fn with_index(tar: Tar, images: &[Value]) -> Tar {
    tar.file(
        "index.json",
        0o644,
        &json_bytes(&json!({"schemaVersion": 2, "manifests": images})),
    )
}

/// A JSON document as bytes.
pub fn json_bytes(value: &Value) -> Vec<u8> {
    value.to_string().into_bytes()
}

/// A layer that contains an agent.
pub fn agent_layer() -> Tar {
    Tar::new()
        .folder("agent/")
        .file("agent/agent.toml", 0o644, IMAGE_MANIFEST.as_bytes())
        .file("agent/agent", 0o755, b"program")
}

/// An image that contains only a shell and the agent `script`. Its `ENV` sets `POSE` and `MODE=image`.
pub fn shell_agent(agent_toml: &str, script: &str) -> TestImage {
    let shell = std::fs::canonicalize("/bin/sh").unwrap();
    let output = std::process::Command::new("ldd").arg(&shell).output();
    let output = String::from_utf8(output.unwrap().stdout).unwrap();
    let system = output
        .split_whitespace()
        .filter(|word| word.starts_with('/'))
        .fold(
            Tar::new()
                .file("opt/bin/sh", 0o755, &std::fs::read(&shell).unwrap())
                .symlink("bin", "/opt/bin"),
            |tar, library| tar.file(&library[1..], 0o755, &std::fs::read(library).unwrap()),
        );
    let agent = Tar::new()
        .file("agent/agent.toml", 0o644, agent_toml.as_bytes())
        .file("agent/agent.sh", 0o755, script.as_bytes());
    TestImage::new([system, agent])
        .packed(Packing::Gzip)
        .config(|config| {
            config["config"]["Env"] = json!([
                "PATH=/opt/bin",
                "MODE=image",
                "POSE=[0,-0.196,0,-1.843,0,0.970,0]"
            ]);
        })
}

/// An agent that holds a pose, and prints its environment variables at the end.
pub const POSE_HOLDING_SCRIPT: &str = r#"#!/bin/sh
number() { n=${line#*"\"$1\":"}; n=${n%%[,\}]*}; }
while read -r line; do
    case $line in
        *'"type":"hello"'*) echo '{"type":"ready","protocol":1,"interpolation":3}' ;;
        *'"type":"reset"'*) number episode; echo "{\"type\":\"ready\",\"episode\":$n}" ;;
        *'"type":"step"'*) number step; echo "{\"type\":\"act\",\"step\":$n,\"action\":[$POSE,[0,0,0,0,0,0,0]]}" ;;
        *'"type":"bye"'*) echo "$MODE $PATH $OWN" >&2; exit ;;
    esac
done
"#;

/// Its `agent.toml`, which replaces one of the image's variables and adds one.
pub const POSE_HOLDING_MANIFEST: &str = "name = \"boxed\"\ncommand = [\"./agent.sh\"]\nruntime = \"image\"\n\
                                     interpolation = 3\n[env]\nMODE = \"toml\"\nOWN = \"own\"\n";
