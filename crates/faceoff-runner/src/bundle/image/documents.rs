//! Which layers an archive's image has, by its own documents.

use super::{
    archive::{Archive, DOCKER_LIST, OCI_INDEX},
    digest::Digest,
    env,
    words::{invalid, what_to_write},
};
use crate::bundle::error::BundleError;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};

/// As many as the file system of most container engines can stack.
const MOST_LAYERS: usize = 127;
/// What lists of images are, beside the images in them.
const LIST_TYPES: [&str; 2] = [
    "application/vnd.oci.image.index.v1+json",
    "application/vnd.docker.distribution.manifest.list.v2+json",
];
/// Says of an entry of a list that it is no image, but tells of one (how it was built, say).
const TELLS_OF_ANOTHER: &str = "vnd.docker.reference.type";

/// What makes the image's root.
pub(super) struct Parts {
    pub env: BTreeMap<String, String>,
    /// The lowest one first.
    pub layers: Vec<LayerPart>,
}

/// One layer.
pub(super) struct LayerPart {
    /// Its file in the archive.
    pub name: String,
    /// Of its uncompressed content.
    pub diff_id: Digest,
}

/// An entry of `manifest.json`, as `docker save` writes it. Tags of one image are in one entry.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
struct DockerImage {
    #[serde(rename = "Config")]
    config: String,
    #[serde(rename = "Layers")]
    layers: Vec<String>,
}

/// A list of images in the Open Container Initiative's layout.
#[derive(Debug, Deserialize)]
struct OciList {
    manifests: Vec<Descriptor>,
}

/// One image there.
#[derive(Debug, Deserialize)]
struct OciImage {
    config: Descriptor,
    layers: Vec<Descriptor>,
}

#[derive(Debug, Clone, Deserialize)]
struct Descriptor {
    digest: String,
    #[serde(rename = "mediaType", default)]
    media_type: String,
    platform: Option<Platform>,
    #[serde(default)]
    annotations: BTreeMap<String, String>,
}

#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
struct Platform {
    architecture: String,
    os: String,
}

/// An image's configuration; what it says of how to start something is not used.
#[derive(Debug, Deserialize)]
struct Config {
    #[serde(flatten)]
    platform: Platform,
    config: Option<Variables>,
    rootfs: RootFs,
}

#[derive(Debug, Deserialize)]
struct Variables {
    #[serde(rename = "Env")]
    env: Option<Vec<String>>,
}

#[derive(Debug, Deserialize)]
struct RootFs {
    diff_ids: Vec<String>,
}

impl Platform {
    /// The one whose programs run here.
    fn of_this_host() -> Self {
        let architecture = match std::env::consts::ARCH {
            "x86_64" => "amd64",
            "aarch64" => "arm64",
            other => other,
        };
        Self {
            architecture: architecture.to_owned(),
            os: "linux".to_owned(),
        }
    }
}

impl std::fmt::Display for Platform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shown = |text: &str| text.chars().take(40).collect::<String>();
        let platform = format!("{}/{}", shown(&self.os), shown(&self.architecture));
        f.write_str(&faceoff_types::harmless(&platform))
    }
}

/// Finds the only image of the archive and its layers. Docker's list is asked first: newer versions write the
/// layout beside it.
pub(super) fn read(archive: &mut Archive<'_>) -> Result<Parts, BundleError> {
    let image = if archive.has(DOCKER_LIST) {
        of_docker(archive)?
    } else {
        of_layout(archive)?
    };
    if image.layers.len() > MOST_LAYERS {
        return Err(invalid(format_args!(
            "has {} layers; at most {MOST_LAYERS} are allowed: build it with fewer steps",
            image.layers.len()
        )));
    }
    let config: Config = archive.document(&image.config)?;
    let host = Platform::of_this_host();
    if config.platform != host {
        return Err(invalid(format_args!(
            "is for {}, and this server runs {host}: build it with --platform {host}",
            config.platform
        )));
    }
    let diff_ids = &config.rootfs.diff_ids;
    if diff_ids.len() != image.layers.len() {
        return Err(invalid(format_args!(
            "has {} layers, and its configuration knows of {}",
            image.layers.len(),
            diff_ids.len()
        )));
    }
    let part = |(name, diff_id): (String, &String)| {
        Ok(LayerPart {
            name,
            diff_id: Digest::parse(diff_id)?,
        })
    };
    let layers = image.layers.into_iter().zip(diff_ids).map(part);
    let variables = config.config.and_then(|config| config.env);
    Ok(Parts {
        env: env::read(&variables.unwrap_or_default())?,
        layers: layers.collect::<Result<_, BundleError>>()?,
    })
}

fn of_docker(archive: &mut Archive<'_>) -> Result<DockerImage, BundleError> {
    let all: Vec<DockerImage> = archive.document(DOCKER_LIST).map_err(no_image)?;
    let mut images: BTreeSet<DockerImage> = all.into_iter().collect();
    match (images.pop_first(), images.len()) {
        (Some(image), 0) => Ok(image),
        (Some(_), more) => Err(several(more + 1)),
        (None, _) => Err(no_image(invalid("is missing: manifest.json names none"))),
    }
}

fn of_layout(archive: &mut Archive<'_>) -> Result<DockerImage, BundleError> {
    let list: OciList = archive.document(OCI_INDEX).map_err(no_image)?;
    let image = choose(images_of(archive, list)?)?;
    let image: OciImage = archive.document(&Digest::parse(&image.digest)?.blob())?;
    let blob = |part: &Descriptor| Digest::parse(&part.digest).map(|digest| digest.blob());
    Ok(DockerImage {
        config: blob(&image.config)?,
        layers: image.layers.iter().map(blob).collect::<Result<_, _>>()?,
    })
}

/// All images of a list and of the lists in it, each once.
fn images_of(archive: &mut Archive<'_>, list: OciList) -> Result<Vec<Descriptor>, BundleError> {
    let mut images = Vec::new();
    let mut seen = BTreeSet::new();
    let mut todo = list.manifests;
    while let Some(entry) = todo.pop() {
        let digest = Digest::parse(&entry.digest)?;
        if entry.annotations.contains_key(TELLS_OF_ANOTHER) || !seen.insert(digest.clone()) {
            continue;
        }
        if LIST_TYPES.contains(&entry.media_type.as_str()) {
            // How many documents are read is bounded.
            let inner: OciList = archive.document(&digest.blob())?;
            todo.extend(inner.manifests);
        } else {
            images.push(entry);
        }
    }
    Ok(images)
}

/// The only image, or of several the only one for this host.
fn choose(mut images: Vec<Descriptor>) -> Result<Descriptor, BundleError> {
    let count = images.len();
    if count > 1 {
        let host = Platform::of_this_host();
        let others: BTreeSet<String> = images
            .iter()
            .filter_map(|image| image.platform.as_ref().map(ToString::to_string))
            .collect();
        images.retain(|image| image.platform.as_ref().is_none_or(|one| *one == host));
        if images.is_empty() {
            let others: Vec<String> = others.into_iter().take(8).collect();
            return Err(invalid(format_args!(
                "is for {}, and this server runs {host}: build it with --platform {host}",
                others.join(", ")
            )));
        }
    }
    match (images.pop(), images.len()) {
        (Some(image), 0) => Ok(image),
        (Some(_), more) => Err(several(more + 1)),
        (None, _) => Err(no_image(invalid("is missing: index.json names none"))),
    }
}

fn several(count: usize) -> BundleError {
    BundleError::Invalid(format!(
        "the archive holds {count} container images: expected one; save the agent's alone, by its name"
    ))
}

/// What is no image may have been meant as a bundle of files.
fn no_image(error: BundleError) -> BundleError {
    match error {
        BundleError::Invalid(told) => BundleError::Invalid(format!(
            "there is no agent.toml at the archive's root, and {told}. A bundle is a folder with an agent.toml, or \
             a container image: {}",
            what_to_write()
        )),
        ours => ours,
    }
}
