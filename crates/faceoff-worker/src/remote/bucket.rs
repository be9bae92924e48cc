//! Bundles and recordings by a bucket of S3, or of what speaks as it does, in the place of the server's own HTTP: workers get links that
//! expire, and no key.

use anyhow::Context as _;
use faceoff_dataset::files_of;
use faceoff_store::Artifacts;
use faceoff_types::BundleRef;
use faceoff_wire::{grant::Grant, remote::Objects};
use futures::{StreamExt as _, TryStreamExt as _};
use object_store::{
    ClientOptions, ObjectStore, ObjectStoreExt as _, RetryConfig, WriteMultipart,
    aws::{AmazonS3, AmazonS3Builder},
    client::{HttpClient, HttpConnector},
    path::Path as Key,
    signer::Signer as _,
};
use reqwest::Method;
use std::{
    collections::{BTreeMap, HashMap},
    fmt, fs, io,
    io::Write as _,
    path::PathBuf,
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};
use tokio::io::AsyncReadExt as _;
use uuid::Uuid;

/// For how long a link is good: longer than the longest game or shard takes.
const LINKS_FOR: Duration = Duration::from_secs(24 * 3600);
/// What fails is tried again by whoever gives out and takes in, who also says so.
const ANSWERS_WITHIN: Duration = Duration::from_secs(10);
/// After this it is looked whether a bundle is still there: a bucket may end what it holds.
const SEEN_FOR: Duration = Duration::from_secs(600);
/// Bytes in memory per piece of a copy.
const PIECE_BYTES: usize = 8 << 20;
/// The largest file of a recording, in bytes: far more than any shard has.
const LARGEST_BYTES: u64 = 4 << 30;

/// Where a bucket is, and where files wait that come out of it.
#[derive(Debug, Clone)]
pub struct BucketConfig {
    /// `s3://BUCKET` or `s3://BUCKET/PREFIX`; keys, region and endpoint are the environment's (`AWS_…`).
    pub url: String,
    /// By which it is reached.
    pub http: reqwest::Client,
    /// For files that have come only in part; it exists.
    pub folder: PathBuf,
}

pub(super) struct Bucket {
    objects: AmazonS3,
    prefix: Key,
    folder: PathBuf,
    /// BLAKE3 of bundles, and when they were last seen to be there.
    bundles: Mutex<HashMap<String, Instant>>,
}

/// The client is the program's own: there is one way in it to trust others.
struct Connector(reqwest::Client);

impl fmt::Debug for Connector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Connector")
    }
}

impl HttpConnector for Connector {
    fn connect(&self, _: &ClientOptions) -> object_store::Result<HttpClient> {
        Ok(HttpClient::new(self.0.clone()))
    }
}

impl Bucket {
    pub(super) fn open(config: BucketConfig) -> anyhow::Result<Self> {
        let named = config.url.strip_prefix("s3://").unwrap_or_default();
        let (bucket, prefix) = named.split_once('/').unwrap_or((named, ""));
        let objects = AmazonS3Builder::from_env()
            .with_bucket_name(bucket)
            .with_http_connector(Connector(config.http))
            .with_retry(RetryConfig {
                max_retries: 2,
                retry_timeout: ANSWERS_WITHIN,
                ..RetryConfig::default()
            })
            .build()
            .with_context(|| format!("nats.bucket {}", config.url))?;
        Ok(Self {
            objects,
            prefix: Key::parse(prefix).context("nats.bucket")?,
            folder: config.folder,
            bundles: Mutex::default(),
        })
    }

    /// Is it there? What is claimed for it otherwise comes back.
    pub(super) async fn probe(&self) -> anyhow::Result<()> {
        match self.objects.head(&self.bundle("probe")).await {
            Ok(_) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(error).context("asking for the bucket"),
        }
    }

    /// Links to what an order opens. Bundles that are not in the bucket are put there.
    pub(super) async fn opens(
        &self,
        grant: &Grant,
        artifacts: &Artifacts,
    ) -> anyhow::Result<Objects> {
        let mut bundles = BTreeMap::new();
        for bundle in &grant.bundles {
            let key = self.bundle(&bundle.blake3);
            self.offer(bundle, &key, artifacts)
                .await
                .with_context(|| format!("putting a bundle into the bucket, at {key}"))?;
            let link = self
                .objects
                .signed_url(Method::GET, &key, LINKS_FOR)
                .await?;
            bundles.insert(bundle.blake3.clone(), link.to_string());
        }
        let mut files = BTreeMap::new();
        for name in files_of(grant) {
            let key = self.file(grant.nonce, name);
            let link = self
                .objects
                .signed_url(Method::PUT, &key, LINKS_FOR)
                .await?;
            files.insert((*name).to_owned(), link.to_string());
        }
        Ok(Objects { bundles, files })
    }

    async fn offer(
        &self,
        bundle: &BundleRef,
        key: &Key,
        artifacts: &Artifacts,
    ) -> anyhow::Result<()> {
        let known = || self.bundles.lock().unwrap_or_else(PoisonError::into_inner);
        if known()
            .get(&bundle.blake3)
            .is_some_and(|seen| seen.elapsed() < SEEN_FOR)
        {
            return Ok(());
        }
        match self.objects.head(key).await {
            Ok(found) if found.size == bundle.bytes => {}
            Ok(_) | Err(object_store::Error::NotFound { .. }) => {
                let mut file = tokio::fs::File::open(artifacts.path_of(&bundle.key)?).await?;
                let upload = self.objects.put_multipart(key).await?;
                let mut upload = WriteMultipart::new_with_chunk_size(upload, PIECE_BYTES);
                let mut piece = vec![0; PIECE_BYTES];
                loop {
                    let bytes = file.read(&mut piece).await?;
                    if bytes == 0 {
                        break;
                    }
                    upload.wait_for_capacity(4).await?;
                    upload.write(&piece[..bytes]);
                }
                upload.finish().await?;
            }
            Err(error) => return Err(error.into()),
        }
        known().insert(bundle.blake3.clone(), Instant::now());
        Ok(())
    }

    /// Takes over what was stored under an order.
    pub(super) async fn take(&self, grant: &Grant, artifacts: &Artifacts) -> anyhow::Result<()> {
        for name in files_of(grant) {
            let Some(to) = grant.key_of(name) else {
                continue;
            };
            let from = self.file(grant.nonce, name);
            let found = match self.objects.get(&from).await {
                Ok(found) => found,
                // What must be there is missed by whoever reads it.
                Err(object_store::Error::NotFound { .. }) => continue,
                Err(error) => return Err(error).context("taking a recording out of the bucket"),
            };
            if found.meta.size > LARGEST_BYTES {
                let bytes = found.meta.size;
                tracing::error!(%from, bytes, "no recording has so large a file; it is left out");
                continue;
            }
            let mut file = tempfile::NamedTempFile::new_in(&self.folder)?;
            let mut bytes = found.into_stream();
            while let Some(piece) = bytes.try_next().await? {
                file = tokio::task::spawn_blocking(move || -> io::Result<_> {
                    file.write_all(&piece)?;
                    Ok(file)
                })
                .await??;
            }
            artifacts.put_file(&to, file.path()).await?;
        }
        Ok(())
    }

    /// Removes what was stored under an order: it has been taken over, or nobody wants it.
    pub(super) async fn forget(&self, grant: &Grant) {
        let keys = files_of(grant)
            .iter()
            .map(|name| Ok(self.file(grant.nonce, name)));
        let keys = futures::stream::iter(keys.collect::<Vec<_>>()).boxed();
        let mut deleted = self.objects.delete_stream(keys);
        while let Some(one) = deleted.next().await {
            match one {
                Ok(_) | Err(object_store::Error::NotFound { .. }) => {}
                Err(error) => {
                    tracing::warn!(%error, "a file stays in the bucket until its lifetime ends");
                }
            }
        }
    }

    fn bundle(&self, blake3: &str) -> Key {
        self.prefix.clone().join("bundles").join(blake3)
    }

    fn file(&self, nonce: Uuid, name: &str) -> Key {
        let folder = self.prefix.clone().join("orders");
        folder.join(nonce.to_string()).join(name)
    }
}

impl BucketConfig {
    /// Makes the folder, empty of what a former life has left.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn make_folder(&self) -> anyhow::Result<()> {
        let made = || {
            match fs::remove_dir_all(&self.folder) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
            fs::create_dir_all(&self.folder)
        };
        made().with_context(|| format!("making the folder {}", self.folder.display()))
    }
}
