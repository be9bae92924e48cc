//! Finds the layers of a container image in the JSON documents of its archive. An archive has a list of images, written
//! by Docker, or an *OCI layout* (the format of the Open Container Initiative), or both.

use super::{
    archive::{Archive, DOCKER_LIST, OCI_INDEX},
    digest::Digest,
    env,
    messages::{dockerfile_hint, invalid},
};
use crate::bundle::error::BundleError;
use faceoff_types::escape_unprintable;
use serde::{Deserialize, de::IgnoredAny};
use std::collections::{BTreeMap, BTreeSet};

/// As many layers as the file system of most container engines can stack.
const MAX_LAYERS: usize = 127;
/// Maximum number of entries in all lists of one archive.
const MAX_ENTRIES: usize = 256;
/// Maximum shown length of a layer's build step, in characters.
const STEP_MAX_CHARS: usize = 80;
/// Media types of lists of images.
const LIST_TYPES: [&str; 2] = [
    "application/vnd.oci.image.index.v1+json",
    "application/vnd.docker.distribution.manifest.list.v2+json",
];

/// Environment and layers of an image.
pub(super) struct ImageParts {
    pub env: BTreeMap<String, String>,
    /// In the order of application, the lowest first.
    pub layers: Vec<LayerPart>,
}

/// One layer of an image.
pub(super) struct LayerPart {
    /// The layer's file in the archive.
    pub name: String,
    /// Digest of its uncompressed content.
    pub diff_id: Digest,
    /// The build step that created it, as in a Dockerfile.
    pub step: Option<String>,
}

impl LayerPart {
    /// Adds the layer to the message of an error. `number`: position of the layer from below, from 1.
    pub fn add_layer_to(&self, error: BundleError, number: usize, count: usize) -> BundleError {
        let step = self.step.as_ref();
        let step = step.map_or(String::new(), |step| format!(" ({step})"));
        match error {
            BundleError::Invalid(message) => BundleError::Invalid(format!(
                "layer {number} of the image's {count}{step}: {message}"
            )),
            other => other,
        }
    }
}

/// Configuration and layers of an image, as file names in the archive. The entries of Docker's `manifest.json` have this form, with all
/// tags of an image in one entry; for an OCI layout it is composed.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
struct ImageManifest {
    #[serde(rename = "Config")]
    config: String,
    #[serde(rename = "Layers")]
    layers: Vec<String>,
    /// Its names; an image may have several.
    #[serde(rename = "RepoTags")]
    tags: Option<Vec<String>>,
}

/// A list of images in an OCI layout.
#[derive(Debug, Deserialize)]
struct OciList {
    /// Some engines write an empty list as `null`.
    manifests: Option<Vec<Descriptor>>,
}

#[derive(Debug, Deserialize)]
struct OciImage {
    config: Descriptor,
    layers: Option<Vec<Descriptor>>,
}

/// A reference to a document or a layer, by its digest.
#[derive(Debug, Clone, Deserialize)]
struct Descriptor {
    digest: String,
    #[serde(rename = "mediaType", default)]
    media_type: String,
    platform: Option<Platform>,
    #[serde(default)]
    annotations: Annotations,
}

#[derive(Debug, Clone, Default, Deserialize)]
struct Annotations {
    /// Set if the entry is not an image, but describes one (an attestation of its build, say).
    #[serde(rename = "vnd.docker.reference.type")]
    reference_type: Option<IgnoredAny>,
}

#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
struct Platform {
    architecture: String,
    os: String,
    /// The CPU variant that the image needs, e.g. `v3`.
    variant: Option<String>,
}

/// An image's configuration. Its settings for starting a program are not used.
#[derive(Debug, Deserialize)]
struct Config {
    #[serde(flatten)]
    platform: Platform,
    config: Option<Variables>,
    rootfs: RootFs,
    #[serde(default)]
    history: Option<Vec<Step>>,
}

/// A build step in the image's history.
#[derive(Debug, Deserialize)]
struct Step {
    #[serde(default)]
    created_by: String,
    #[serde(default)]
    empty_layer: bool,
}

/// Environment variables of an image.
#[derive(Debug, Deserialize)]
struct Variables {
    #[serde(rename = "Env")]
    env: Option<Vec<String>>,
}

/// Digests of the uncompressed layers, the lowest first.
#[derive(Debug, Deserialize)]
struct RootFs {
    diff_ids: Option<Vec<String>>,
}

impl Platform {
    /// The platform of this host.
    fn host() -> Self {
        let architecture = match std::env::consts::ARCH {
            "x86_64" => "amd64",
            "aarch64" => "arm64",
            other => other,
        };
        Self {
            architecture: architecture.to_owned(),
            os: "linux".to_owned(),
            variant: None,
        }
    }

    fn matches_host(&self) -> bool {
        let host = Self::host();
        (&self.architecture, &self.os) == (&host.architecture, &host.os)
    }

    /// Does the image run on every processor of its architecture?
    fn is_general(&self) -> bool {
        matches!(self.variant.as_deref(), None | Some("" | "v1" | "v8"))
    }
}

impl std::fmt::Display for Platform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shown = |text: &str| text.chars().take(40).collect::<String>();
        let platform = format!("{}/{}", shown(&self.os), shown(&self.architecture));
        f.write_str(&faceoff_types::escape_unprintable(&platform))
    }
}

/// Finds the only image of the archive and its layers. Docker's list is read first: newer versions also write an OCI
/// layout, some without the layers. Of an image for several platforms, Docker's list has the one of the machine that
/// saved it, and the layout has all.
pub(super) fn read(archive: &mut Archive<'_>) -> Result<ImageParts, BundleError> {
    let (mut image, mut config) = if archive.has_file(DOCKER_LIST) {
        let image = read_docker_list(archive)?;
        let config: Config = archive.document(&image.config)?;
        (image, config)
    } else {
        read_oci_layout(archive)?
    };
    if !config.platform.matches_host()
        && archive.has_file(DOCKER_LIST)
        && archive.is_layout()
        && let Ok((other, other_config)) = read_oci_layout(archive)
        && other_config.platform.matches_host()
    {
        (image, config) = (other, other_config);
    }
    if image.layers.len() > MAX_LAYERS {
        return Err(invalid(format_args!(
            "has {} layers; at most {MAX_LAYERS} are allowed: build it with fewer steps",
            image.layers.len()
        )));
    }
    if !config.platform.matches_host() {
        return Err(wrong_platform(&config.platform.to_string()));
    }
    let diff_ids = config.rootfs.diff_ids.unwrap_or_default();
    if diff_ids.len() != image.layers.len() {
        return Err(invalid(format_args!(
            "has {} layers, and its configuration lists {}",
            image.layers.len(),
            diff_ids.len()
        )));
    }
    let steps = build_steps(config.history.unwrap_or_default(), diff_ids.len());
    let layer_part = |((name, diff_id), step): ((String, &String), Option<String>)| {
        Ok(LayerPart {
            name,
            diff_id: Digest::parse(diff_id)?,
            step,
        })
    };
    let layers = image
        .layers
        .into_iter()
        .zip(&diff_ids)
        .zip(steps)
        .map(layer_part);
    let variables = config.config.and_then(|config| config.env);
    Ok(ImageParts {
        env: env::parse(&variables.unwrap_or_default())?,
        layers: layers.collect::<Result<_, BundleError>>()?,
    })
}

/// The build step of each layer, if the history has the same number of steps.
fn build_steps(history: Vec<Step>, layers: usize) -> Vec<Option<String>> {
    let steps: Vec<String> = history
        .into_iter()
        .filter(|step| !step.empty_layer)
        .map(|step| step.created_by)
        .collect();
    if steps.len() != layers {
        return vec![None; layers];
    }
    let shown = |step: String| {
        let words: Vec<&str> = step.split_whitespace().collect();
        let step: String = escape_unprintable(&words.join(" "))
            .chars()
            .take(STEP_MAX_CHARS)
            .collect();
        (!step.is_empty()).then_some(step)
    };
    steps.into_iter().map(shown).collect()
}

fn read_docker_list(archive: &mut Archive<'_>) -> Result<ImageManifest, BundleError> {
    let all: Vec<ImageManifest> = archive.document(DOCKER_LIST).map_err(with_image_hint)?;
    let tags: BTreeSet<String> = all
        .iter()
        .flat_map(|image| image.tags.iter().flatten().cloned())
        .collect();
    let mut images: BTreeSet<ImageManifest> = all
        .into_iter()
        .map(|image| ImageManifest {
            tags: None,
            ..image
        })
        .collect();
    match (images.pop_first(), images.len()) {
        (Some(image), 0) => Ok(image),
        (Some(_), more) => Err(several_images_error(more + 1, &tags)),
        (None, _) => Err(with_image_hint(invalid(
            "is missing: manifest.json names none",
        ))),
    }
}

fn read_oci_layout(archive: &mut Archive<'_>) -> Result<(ImageManifest, Config), BundleError> {
    let list: OciList = archive.document(OCI_INDEX).map_err(with_image_hint)?;
    let image = choose_image(collect_images(archive, list)?)?;
    let image: OciImage = archive.document(&Digest::parse(&image.digest)?.blob_path())?;
    let blob_path = |descriptor: &Descriptor| {
        Digest::parse(&descriptor.digest).map(|digest| digest.blob_path())
    };
    let layers = image.layers.unwrap_or_default();
    let image = ImageManifest {
        config: blob_path(&image.config)?,
        layers: layers.iter().map(blob_path).collect::<Result<_, _>>()?,
        tags: None,
    };
    let config = archive.document(&image.config)?;
    Ok((image, config))
}

/// All images of a list and of its nested lists, each once.
fn collect_images(
    archive: &mut Archive<'_>,
    list: OciList,
) -> Result<Vec<Descriptor>, BundleError> {
    let mut images = Vec::new();
    let mut visited = BTreeSet::new();
    let mut pending = list.manifests.unwrap_or_default();
    let mut entries = pending.len();
    while let Some(entry) = pending.pop() {
        if entries > MAX_ENTRIES {
            return Err(invalid(format_args!(
                "is one of more than {MAX_ENTRIES} in the archive's lists: save it alone"
            )));
        }
        let digest = Digest::parse(&entry.digest)?;
        if entry.annotations.reference_type.is_some() || !visited.insert(digest.clone()) {
            continue;
        }
        if LIST_TYPES.contains(&entry.media_type.as_str()) {
            // The number of documents is limited, so nested lists end.
            let inner: OciList = archive.document(&digest.blob_path())?;
            let inner = inner.manifests.unwrap_or_default();
            entries += inner.len();
            pending.extend(inner);
        } else {
            images.push(entry);
        }
    }
    Ok(images)
}

/// Chooses the only image. Of several images: the only one for this host, or the only one that declares this platform,
/// or the only one of these that needs no particular CPU variant.
fn choose_image(mut images: Vec<Descriptor>) -> Result<Descriptor, BundleError> {
    let count = images.len();
    if count > 1 {
        let platforms: BTreeSet<String> = images
            .iter()
            .filter_map(|image| image.platform.as_ref().map(ToString::to_string))
            .collect();
        let is_for_host = |image: &Descriptor| image.platform.as_ref().map(Platform::matches_host);
        let is_general =
            |image: &Descriptor| image.platform.as_ref().is_none_or(Platform::is_general);
        images.retain(|image| is_for_host(image) != Some(false));
        if images.is_empty() {
            let platforms: Vec<String> = platforms.into_iter().take(8).collect();
            return Err(wrong_platform(&platforms.join(", ")));
        }
        if images.iter().any(|image| is_for_host(image) == Some(true)) {
            images.retain(|image| is_for_host(image) == Some(true));
        }
        if images.iter().any(is_general) {
            images.retain(is_general);
        }
    }
    match (images.pop(), images.len()) {
        (Some(image), 0) => Ok(image),
        (Some(_), more) => Err(several_images_error(more + 1, &BTreeSet::new())),
        (None, _) => Err(with_image_hint(invalid(
            "is missing: index.json names none",
        ))),
    }
}

fn wrong_platform(platforms: &str) -> BundleError {
    let host = Platform::host();
    invalid(format_args!(
        "is for {platforms}, and this server runs {host}: build it with --platform {host}, and save that one"
    ))
}

/// An error for an archive with several images. `docker save` with a name but no tag saves all tags.
fn several_images_error(count: usize, tags: &BTreeSet<String>) -> BundleError {
    let shown = |tag: &String| escape_unprintable(tag).chars().take(60).collect::<String>();
    let tags: Vec<String> = tags.iter().take(8).map(shown).collect();
    let tags = match tags.is_empty() {
        true => String::new(),
        false => format!(" ({})", tags.join(", ")),
    };
    BundleError::Invalid(format!(
        "the archive contains {count} container images{tags}: expected one; save the agent's alone, by its name and its \
         tag: `docker save -o ours.tar ours:latest`"
    ))
}

/// Adds a hint to an error, because the archive may have been meant as a bundle of files.
fn with_image_hint(error: BundleError) -> BundleError {
    match error {
        BundleError::Invalid(message) => BundleError::Invalid(format!(
            "there is no agent.toml at the archive's root, and {message}. A bundle is a folder with an agent.toml, or \
             a container image: {}",
            dockerfile_hint()
        )),
        other => other,
    }
}
