//! Transfer of bundles and recordings through an S3-compatible bucket in place of the server's HTTP. Workers get links that
//! expire, but no credentials.

use anyhow::Context as _;
use faceoff_dataset::{max_file_bytes, writable_files};
use faceoff_store::Artifacts;
use faceoff_types::BundleRef;
use faceoff_wire::{grant::Grant, remote::ObjectLinks};
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

/// Validity of a link: longer than the longest game or shard takes.
const LINK_VALIDITY: Duration = Duration::from_secs(24 * 3600);
/// Timeout of requests to the bucket. The callers retry and log failures.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);
/// After this time the presence of a bundle is checked again, since buckets may delete objects.
const RECHECK_AFTER: Duration = Duration::from_secs(600);
/// Bytes in memory per part of an upload.
const PART_BYTES: usize = 8 << 20;
/// Maximum number of parts that are uploaded at the same time.
const MAX_CONCURRENT_PARTS: usize = 4;

/// Configuration of a bucket.
#[derive(Debug, Clone)]
pub struct BucketConfig {
    /// `s3://BUCKET` or `s3://BUCKET/PREFIX`; credentials, region and endpoint come from the environment (`AWS_…`).
    pub url: String,
    /// HTTP client for the bucket.
    pub http: reqwest::Client,
    /// An existing folder for partial downloads.
    pub folder: PathBuf,
}

/// A bucket, opened by the server.
pub(super) struct Bucket {
    objects: AmazonS3,
    /// Prefix of all keys, from the configured URL.
    prefix: Key,
    /// Folder for partial downloads.
    folder: PathBuf,
    /// BLAKE3 of bundles, with the time when their presence was last checked.
    bundles: Mutex<HashMap<String, Instant>>,
}

/// Makes the crate `object_store` use the program's own HTTP client, with its trusted certificates.
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
        let path = config.url.strip_prefix("s3://").unwrap_or_default();
        let (bucket, prefix) = path.split_once('/').unwrap_or((path, ""));
        let objects = AmazonS3Builder::from_env()
            .with_bucket_name(bucket)
            .with_http_connector(Connector(config.http))
            .with_retry(RetryConfig {
                max_retries: 2,
                retry_timeout: REQUEST_TIMEOUT,
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

    /// Checks that the bucket is reachable, so that no jobs are claimed while it is not: they would only be released again.
    pub(super) async fn probe(&self) -> anyhow::Result<()> {
        match self.objects.head(&self.bundle_key("probe")).await {
            Ok(_) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(error).context("reaching the bucket"),
        }
    }

    /// Creates links to the files of a grant. Uploads bundles that are not in the bucket.
    pub(super) async fn create_links(
        &self,
        grant: &Grant,
        artifacts: &Artifacts,
    ) -> anyhow::Result<ObjectLinks> {
        let mut bundles = BTreeMap::new();
        for bundle in &grant.bundles {
            let key = self.bundle_key(&bundle.blake3);
            self.ensure_uploaded(bundle, &key, artifacts)
                .await
                .with_context(|| format!("putting a bundle into the bucket, at {key}"))?;
            let link = self
                .objects
                .signed_url(Method::GET, &key, LINK_VALIDITY)
                .await?;
            bundles.insert(bundle.blake3.clone(), link.to_string());
        }
        let mut files = BTreeMap::new();
        for name in writable_files(grant) {
            let key = self.file_key(grant.nonce, name);
            let link = self
                .objects
                .signed_url(Method::PUT, &key, LINK_VALIDITY)
                .await?;
            files.insert((*name).to_owned(), link.to_string());
        }
        Ok(ObjectLinks { bundles, files })
    }

    async fn ensure_uploaded(
        &self,
        bundle: &BundleRef,
        key: &Key,
        artifacts: &Artifacts,
    ) -> anyhow::Result<()> {
        let bundles = || self.bundles.lock().unwrap_or_else(PoisonError::into_inner);
        if bundles()
            .get(&bundle.blake3)
            .is_some_and(|checked| checked.elapsed() < RECHECK_AFTER)
        {
            return Ok(());
        }
        match self.objects.head(key).await {
            Ok(found) if found.size == bundle.bytes => {}
            Ok(_) | Err(object_store::Error::NotFound { .. }) => {
                let mut file = tokio::fs::File::open(artifacts.local_path(&bundle.key)?).await?;
                let upload = self.objects.put_multipart(key).await?;
                let mut upload = WriteMultipart::new_with_chunk_size(upload, PART_BYTES);
                let mut part = vec![0; PART_BYTES];
                loop {
                    let bytes = file.read(&mut part).await?;
                    if bytes == 0 {
                        break;
                    }
                    upload.wait_for_capacity(MAX_CONCURRENT_PARTS).await?;
                    upload.write(&part[..bytes]);
                }
                upload.finish().await?;
            }
            Err(error) => return Err(error.into()),
        }
        bundles().insert(bundle.blake3.clone(), Instant::now());
        Ok(())
    }

    /// Copies the files that were stored under a grant into the artifacts.
    pub(super) async fn fetch_files(
        &self,
        grant: &Grant,
        artifacts: &Artifacts,
    ) -> anyhow::Result<()> {
        for name in writable_files(grant) {
            let Some(artifact_key) = grant.storage_key(name) else {
                continue;
            };
            let object_key = self.file_key(grant.nonce, name);
            let object = match self.objects.get(&object_key).await {
                Ok(object) => object,
                // If the file is required, a later check of the recording reports that it is missing.
                Err(object_store::Error::NotFound { .. }) => continue,
                Err(error) => return Err(error).context("fetching a recording from the bucket"),
            };
            if object.meta.size > max_file_bytes(name) {
                let bytes = object.meta.size;
                tracing::error!(%object_key, bytes, "the file is too large for a recording; ignored");
                continue;
            }
            let mut file = tempfile::NamedTempFile::new_in(&self.folder)?;
            let mut chunks = object.into_stream();
            while let Some(chunk) = chunks.try_next().await? {
                file = tokio::task::spawn_blocking(move || -> io::Result<_> {
                    file.write_all(&chunk)?;
                    Ok(file)
                })
                .await??;
            }
            artifacts.put_file(&artifact_key, file.path()).await?;
        }
        Ok(())
    }

    /// Deletes the files that were stored under a grant, after they were copied or refused.
    pub(super) async fn delete_files(&self, grant: &Grant) {
        let keys = writable_files(grant)
            .iter()
            .map(|name| Ok(self.file_key(grant.nonce, name)));
        let keys = futures::stream::iter(keys.collect::<Vec<_>>()).boxed();
        let mut deleted = self.objects.delete_stream(keys);
        while let Some(result) = deleted.next().await {
            match result {
                Ok(_) | Err(object_store::Error::NotFound { .. }) => {}
                Err(error) => {
                    tracing::warn!(%error, "a file in the bucket could not be deleted; it remains until the bucket deletes it");
                }
            }
        }
    }

    fn bundle_key(&self, blake3: &str) -> Key {
        self.prefix.clone().join("bundles").join(blake3)
    }

    fn file_key(&self, nonce: Uuid, name: &str) -> Key {
        let folder = self.prefix.clone().join("orders");
        folder.join(nonce.to_string()).join(name)
    }
}

impl BucketConfig {
    /// Creates the folder, without files of an earlier process.
    ///
    /// # Errors
    /// If the folder cannot be created.
    pub fn create_folder(&self) -> anyhow::Result<()> {
        let create = || {
            match fs::remove_dir_all(&self.folder) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
            fs::create_dir_all(&self.folder)
        };
        create().with_context(|| format!("creating the folder {}", self.folder.display()))
    }
}
