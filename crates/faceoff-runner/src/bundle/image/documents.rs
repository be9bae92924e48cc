//! Which layers an archive's image has, by its own documents.

use super::{
    archive::{Archive, DOCKER_LIST, OCI_INDEX},
    digest::Digest,
    env,
    words::{invalid, what_to_write},
};
use crate::bundle::error::BundleError;
use faceoff_types::harmless;
use serde::{Deserialize, de::IgnoredAny};
use std::collections::{BTreeMap, BTreeSet};

/// As many as the file system of most container engines can stack.
const MOST_LAYERS: usize = 127;
/// How many entries the lists of one archive may have in all.
const MOST_ENTRIES: usize = 256;
/// How much is shown of the step that made a layer, in characters.
const STEP_SHOWN: usize = 80;
/// What lists of images are, beside the images in them.
const LIST_TYPES: [&str; 2] = [
    "application/vnd.oci.image.index.v1+json",
    "application/vnd.docker.distribution.manifest.list.v2+json",
];

/// What makes the image's root.
pub(super) struct Parts {
    pub env: BTreeMap<String, String>,
    /// The lowest one first.
    pub layers: Vec<LayerPart>,
}

pub(super) struct LayerPart {
    /// Its file in the archive.
    pub name: String,
    /// Of its uncompressed content.
    pub diff_id: Digest,
    /// The step that made it, as a Dockerfile has it.
    pub made_by: Option<String>,
}

impl LayerPart {
    /// What is wrong in this layer, the `number`th from below, from 1.
    pub fn in_it(&self, error: BundleError, number: usize, count: usize) -> BundleError {
        let step = self.made_by.as_ref();
        let step = step.map_or(String::new(), |step| format!(" ({step})"));
        match error {
            BundleError::Invalid(told) => BundleError::Invalid(format!(
                "layer {number} of the image's {count}{step}: {told}"
            )),
            ours => ours,
        }
    }
}

/// An entry of `manifest.json`, as `docker save` writes it. Tags of one image are in one entry.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
struct DockerImage {
    #[serde(rename = "Config")]
    config: String,
    #[serde(rename = "Layers")]
    layers: Vec<String>,
    /// Its names; one image may have several.
    #[serde(rename = "RepoTags")]
    tags: Option<Vec<String>>,
}

/// A list of images in the Open Container Initiative's layout.
#[derive(Debug, Deserialize)]
struct OciList {
    /// None is written as `null` by some.
    manifests: Option<Vec<Descriptor>>,
}

#[derive(Debug, Deserialize)]
struct OciImage {
    config: Descriptor,
    layers: Option<Vec<Descriptor>>,
}

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
    /// Says of an entry of a list that it is no image, but tells of one (how it was built, say).
    #[serde(rename = "vnd.docker.reference.type")]
    tells_of_another: Option<IgnoredAny>,
}

#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
struct Platform {
    architecture: String,
    os: String,
    /// Which extensions of the processor it needs.
    variant: Option<String>,
}

/// An image's configuration; what it says of how to start something is not used.
#[derive(Debug, Deserialize)]
struct Config {
    #[serde(flatten)]
    platform: Platform,
    config: Option<Variables>,
    rootfs: RootFs,
    #[serde(default)]
    history: Option<Vec<Step>>,
}

/// How a layer came about.
#[derive(Debug, Deserialize)]
struct Step {
    #[serde(default)]
    created_by: String,
    #[serde(default)]
    empty_layer: bool,
}

#[derive(Debug, Deserialize)]
struct Variables {
    #[serde(rename = "Env")]
    env: Option<Vec<String>>,
}

#[derive(Debug, Deserialize)]
struct RootFs {
    diff_ids: Option<Vec<String>>,
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
            variant: None,
        }
    }

    fn is_of_this_host(&self) -> bool {
        let host = Self::of_this_host();
        (&self.architecture, &self.os) == (&host.architecture, &host.os)
    }

    /// Does it run on every processor of its architecture?
    fn is_general(&self) -> bool {
        matches!(self.variant.as_deref(), None | Some("" | "v1" | "v8"))
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
/// layout beside it, some without its layers. Of an image for several platforms that list has the one of the machine that
/// saved it, and the layout all.
pub(super) fn read(archive: &mut Archive<'_>) -> Result<Parts, BundleError> {
    let (mut image, mut config) = if archive.has(DOCKER_LIST) {
        let image = of_docker(archive)?;
        let config: Config = archive.document(&image.config)?;
        (image, config)
    } else {
        of_layout(archive)?
    };
    if !config.platform.is_of_this_host()
        && archive.has(DOCKER_LIST)
        && archive.is_layout()
        && let Ok((other, its_config)) = of_layout(archive)
        && its_config.platform.is_of_this_host()
    {
        (image, config) = (other, its_config);
    }
    if image.layers.len() > MOST_LAYERS {
        return Err(invalid(format_args!(
            "has {} layers; at most {MOST_LAYERS} are allowed: build it with fewer steps",
            image.layers.len()
        )));
    }
    if !config.platform.is_of_this_host() {
        return Err(of_another_host(&config.platform.to_string()));
    }
    let diff_ids = config.rootfs.diff_ids.unwrap_or_default();
    if diff_ids.len() != image.layers.len() {
        return Err(invalid(format_args!(
            "has {} layers, and its configuration knows of {}",
            image.layers.len(),
            diff_ids.len()
        )));
    }
    let steps = steps(config.history.unwrap_or_default(), diff_ids.len());
    let part = |((name, diff_id), made_by): ((String, &String), Option<String>)| {
        Ok(LayerPart {
            name,
            diff_id: Digest::parse(diff_id)?,
            made_by,
        })
    };
    let layers = image.layers.into_iter().zip(&diff_ids).zip(steps).map(part);
    let variables = config.config.and_then(|config| config.env);
    Ok(Parts {
        env: env::read(&variables.unwrap_or_default())?,
        layers: layers.collect::<Result<_, BundleError>>()?,
    })
}

/// The step of each layer, where the history knows of as many.
fn steps(history: Vec<Step>, layers: usize) -> Vec<Option<String>> {
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
        let step: String = harmless(&words.join(" "))
            .chars()
            .take(STEP_SHOWN)
            .collect();
        (!step.is_empty()).then_some(step)
    };
    steps.into_iter().map(shown).collect()
}

fn of_docker(archive: &mut Archive<'_>) -> Result<DockerImage, BundleError> {
    let all: Vec<DockerImage> = archive.document(DOCKER_LIST).map_err(no_image)?;
    let tags: BTreeSet<String> = all
        .iter()
        .flat_map(|image| image.tags.iter().flatten().cloned())
        .collect();
    let mut images: BTreeSet<DockerImage> = all
        .into_iter()
        .map(|image| DockerImage {
            tags: None,
            ..image
        })
        .collect();
    match (images.pop_first(), images.len()) {
        (Some(image), 0) => Ok(image),
        (Some(_), more) => Err(several(more + 1, &tags)),
        (None, _) => Err(no_image(invalid("is missing: manifest.json names none"))),
    }
}

fn of_layout(archive: &mut Archive<'_>) -> Result<(DockerImage, Config), BundleError> {
    let list: OciList = archive.document(OCI_INDEX).map_err(no_image)?;
    let image = choose(images_of(archive, list)?)?;
    let image: OciImage = archive.document(&Digest::parse(&image.digest)?.blob())?;
    let blob = |part: &Descriptor| Digest::parse(&part.digest).map(|digest| digest.blob());
    let layers = image.layers.unwrap_or_default();
    let image = DockerImage {
        config: blob(&image.config)?,
        layers: layers.iter().map(blob).collect::<Result<_, _>>()?,
        tags: None,
    };
    let config = archive.document(&image.config)?;
    Ok((image, config))
}

/// All images of a list and of the lists in it, each once.
fn images_of(archive: &mut Archive<'_>, list: OciList) -> Result<Vec<Descriptor>, BundleError> {
    let mut images = Vec::new();
    let mut seen = BTreeSet::new();
    let mut todo = list.manifests.unwrap_or_default();
    let mut entries = todo.len();
    while let Some(entry) = todo.pop() {
        if entries > MOST_ENTRIES {
            return Err(invalid(format_args!(
                "is one of more than {MOST_ENTRIES} in the archive's lists: save it alone"
            )));
        }
        let digest = Digest::parse(&entry.digest)?;
        if entry.annotations.tells_of_another.is_some() || !seen.insert(digest.clone()) {
            continue;
        }
        if LIST_TYPES.contains(&entry.media_type.as_str()) {
            // How many documents are read is bounded.
            let inner: OciList = archive.document(&digest.blob())?;
            let inner = inner.manifests.unwrap_or_default();
            entries += inner.len();
            todo.extend(inner);
        } else {
            images.push(entry);
        }
    }
    Ok(images)
}

/// The only image, or of several the only one for this host, or the only one that says so, or the only one of
/// these that needs no particular processor.
fn choose(mut images: Vec<Descriptor>) -> Result<Descriptor, BundleError> {
    let count = images.len();
    if count > 1 {
        let others: BTreeSet<String> = images
            .iter()
            .filter_map(|image| image.platform.as_ref().map(ToString::to_string))
            .collect();
        let ours = |image: &Descriptor| image.platform.as_ref().map(Platform::is_of_this_host);
        let general = |image: &Descriptor| image.platform.as_ref().is_none_or(Platform::is_general);
        images.retain(|image| ours(image) != Some(false));
        if images.is_empty() {
            let others: Vec<String> = others.into_iter().take(8).collect();
            return Err(of_another_host(&others.join(", ")));
        }
        if images.iter().any(|image| ours(image) == Some(true)) {
            images.retain(|image| ours(image) == Some(true));
        }
        if images.iter().any(general) {
            images.retain(general);
        }
    }
    match (images.pop(), images.len()) {
        (Some(image), 0) => Ok(image),
        (Some(_), more) => Err(several(more + 1, &BTreeSet::new())),
        (None, _) => Err(no_image(invalid("is missing: index.json names none"))),
    }
}

fn of_another_host(platforms: &str) -> BundleError {
    let host = Platform::of_this_host();
    invalid(format_args!(
        "is for {platforms}, and this server runs {host}: build it with --platform {host}, and save that one"
    ))
}

/// Who saves by a name without a tag gets all that have one.
fn several(count: usize, tags: &BTreeSet<String>) -> BundleError {
    let shown = |tag: &String| harmless(tag).chars().take(60).collect::<String>();
    let tags: Vec<String> = tags.iter().take(8).map(shown).collect();
    let tags = match tags.is_empty() {
        true => String::new(),
        false => format!(" ({})", tags.join(", ")),
    };
    BundleError::Invalid(format!(
        "the archive holds {count} container images{tags}: expected one; save the agent's alone, by its name and its \
         tag: `docker save -o ours.tar ours:latest`"
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
