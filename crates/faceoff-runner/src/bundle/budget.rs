//! Cost limits of unpacking an archive, whatever its format, so that no small archive can occupy the host.

use super::error::BundleError;
use faceoff_types::BundleLimits;
use std::{
    cell::{Cell, RefCell},
    io::{self, BufRead, Read, Seek, SeekFrom},
    time::{Duration, Instant},
};

/// Bytes that may be read of an archive in addition to its files' contents (headers, long names, extended
/// attributes, padding, directories), before its first entry.
const OVERHEAD_BYTES: u64 = 16 << 20;
/// Additional overhead per entry: a header with its padding, and as much for its extension headers.
const OVERHEAD_BYTES_PER_ENTRY: u64 = 2 << 10;
/// Maximum number of entries per allowed file: the limit allows as many folders as files, and each of them can have an
/// extension header.
const ENTRIES_PER_FILE: u64 = 4;
/// A seek costs a system call and refills a buffer, so it counts as this many bytes.
const SEEK_BYTES: u64 = 64;
/// Maximum number of successive compressed streams in one file. `bgzip` starts a new stream every 64 KiB. Layers for
/// partial downloads have a stream per file, or several, so the maximum is the number of entries if that is larger.
const MAX_STREAMS: u64 = 1 << 16;
/// Bytes that compressors add to a stream: its header, and notes in it. Apart from this and [`OVERHEAD_BYTES`],
/// compressed data is never larger than its content.
const PACKED_BYTES_PER_STREAM: u64 = 1 << 10;
/// Maximum bytes of names that may be compared while following all links.
const MAX_LINK_BYTES: u64 = 128 << 20;
/// Maximum bytes of names that may be looked up for the entries of an image's layers. A hundred thousand entries with
/// ordinary paths use a tenth of it.
const MAX_LOOKUP_BYTES: u64 = 256 << 20;
/// A name counts as this many additional bytes, because a short name also costs time.
const EXTRA_BYTES_PER_NAME: u64 = 16;

/// The clock is a parameter, so that tests can set the time.
pub(super) type Clock<'a> = &'a dyn Fn() -> Instant;

/// Counts all work that reading an archive causes, and stops at a limit: bytes from the decompressor, entries of any
/// kind, successive streams, seeks.
///
/// All these counts depend only on the archive, so the verdict on it does not depend on the speed of the host. Time is
/// the last limit: it stops work that the counts miss, or a host that hangs. Therefore a timeout is a platform fault
/// and not the archive's.
///
/// The budget stores its failure, because a library between it and the caller may replace the error by its own.
pub(super) struct Budget<'a> {
    limits: BundleLimits,
    deadline: Instant,
    now: Clock<'a>,
    cancelled: &'a dyn Fn() -> bool,
    /// Bytes read through [`MeteredReader`]: everything that the archive consists of.
    read_bytes: Cell<u64>,
    /// Current limit of `read_bytes`.
    allowed_bytes: Cell<u64>,
    /// Bytes of file contents.
    content_bytes: Cell<u64>,
    /// Sum of the file sizes that the archive's directory states.
    stated_bytes: Cell<u64>,
    entries: Cell<u64>,
    streams: Cell<u64>,
    /// Input of the decompressors, in bytes.
    packed_bytes: Cell<u64>,
    /// Output of the decompressors, in bytes.
    decompressed_bytes: Cell<u64>,
    /// Bytes of names compared while following links.
    link_bytes: Cell<u64>,
    /// Bytes of names looked up in an image's root.
    lookup_bytes: Cell<u64>,
    /// Bytes read of an image's packed files.
    image_bytes: Cell<u64>,
    /// Is the content of an image's layers being counted (not that of the archive's files)?
    in_layers: Cell<bool>,
    /// The first exceeded limit, timeout or cancellation.
    failure: RefCell<Option<BundleError>>,
}

impl<'a> Budget<'a> {
    /// An unused budget. `cancelled` is called for every piece that is read, so it must be cheap.
    pub(super) fn new(
        limits: &BundleLimits,
        now: Clock<'a>,
        cancelled: &'a dyn Fn() -> bool,
    ) -> Self {
        Self {
            limits: *limits,
            deadline: now() + Duration::from_secs(limits.unpack_s.into()),
            now,
            cancelled,
            read_bytes: Cell::new(0),
            allowed_bytes: Cell::new(OVERHEAD_BYTES),
            content_bytes: Cell::new(0),
            stated_bytes: Cell::new(0),
            entries: Cell::new(0),
            streams: Cell::new(0),
            packed_bytes: Cell::new(0),
            decompressed_bytes: Cell::new(0),
            link_bytes: Cell::new(0),
            lookup_bytes: Cell::new(0),
            image_bytes: Cell::new(0),
            in_layers: Cell::new(false),
            failure: RefCell::new(None),
        }
    }

    pub(super) const fn limits(&self) -> &BundleLimits {
        &self.limits
    }

    /// Replaces the error of `result` by the failure of this budget, if there is one.
    pub(super) fn prefer_own_failure<T>(
        &self,
        result: Result<T, BundleError>,
    ) -> Result<T, BundleError> {
        match (result, self.failure.take()) {
            (Err(_), Some(reason)) => Err(reason),
            (result, _) => result,
        }
    }

    /// Stores the failure, if it is the first, and returns an error with its text.
    fn fail(&self, failure: BundleError) -> BundleError {
        let message = failure.to_string();
        self.failure.borrow_mut().get_or_insert(failure);
        BundleError::Invalid(message)
    }

    fn refuse(&self, reason: String) -> Result<(), BundleError> {
        Err(self.fail(BundleError::Invalid(reason)))
    }

    /// Checks for an earlier failure, cancellation, the time, and the read bytes; called before each piece of work.
    pub(super) fn check(&self) -> Result<(), BundleError> {
        if self.failure.borrow().is_some() {
            // Any error will do: the stored failure replaces it.
            return Err(BundleError::Cancelled);
        }
        if (self.cancelled)() {
            return Err(self.fail(BundleError::Cancelled));
        }
        if (self.now)() > self.deadline {
            return Err(self.fail(BundleError::Io(io::Error::new(
                io::ErrorKind::TimedOut,
                format!(
                    "unpacking took longer than {} s, which nothing in the archive explains: the host is \
                     too slow, or hangs",
                    self.limits.unpack_s
                ),
            ))));
        }
        let (read, allowed) = (self.read_bytes.get(), self.allowed_bytes.get());
        if read > allowed {
            return self.refuse(format!(
                "the archive has more bytes than its files explain: {read} bytes contained {} entries, \
                 for which at most {allowed} bytes of contents, headers, names and padding are allowed",
                self.entries.get(),
            ));
        }
        Ok(())
    }

    /// Counts an entry of any kind, including one that only describes the next entry.
    pub(super) fn count_entry(&self) -> Result<(), BundleError> {
        let max = self.max_entries();
        self.entries.set(self.entries.get() + 1);
        self.allow(OVERHEAD_BYTES_PER_ENTRY);
        if self.entries.get() > max {
            return self.refuse(format!(
                "the archive has more than {max} entries of all kinds"
            ));
        }
        self.check()
    }

    fn max_entries(&self) -> u64 {
        self.limits.files.saturating_mul(ENTRIES_PER_FILE)
    }

    /// Counts content of a file, including files that are left out.
    pub(super) fn count_content(&self, entry: &str, bytes: usize) -> Result<(), BundleError> {
        self.content_bytes
            .set(self.content_bytes.get() + bytes as u64);
        self.check_content(entry, self.content_bytes.get())
    }

    /// Counts the size of a file according to the archive's directory, before its content is read.
    pub(super) fn count_stated(&self, entry: &str, bytes: u64) -> Result<(), BundleError> {
        self.stated_bytes
            .set(self.stated_bytes.get().saturating_add(bytes));
        self.check_content(entry, self.stated_bytes.get())
    }

    fn check_content(&self, entry: &str, bytes: u64) -> Result<(), BundleError> {
        let max = self.limits.unpacked_bytes;
        if bytes > max {
            return self.refuse(if self.in_layers.get() {
                format!(
                    "the image's layers contain more than {max} bytes (stopped at entry {entry:?}): \
                     start from a smaller image, and install and clean up in one step"
                )
            } else {
                format!(
                    "the archive unpacks to more than {max} bytes (stopped at entry {entry:?})"
                )
            });
        }
        Ok(())
    }

    /// Starts counting the content of an image's layers, which have been unpacked as files before: the content has its
    /// own limit. All other counts continue.
    pub(super) fn begin_layers(&self) {
        self.content_bytes.set(0);
        self.in_layers.set(true);
    }

    /// Counts bytes read of an image's packed files. Each file is needed once, and together they have the limit of the
    /// unpacked bytes; a layer that is named several times is read several times.
    pub(super) fn count_image_bytes(&self, bytes: usize) -> io::Result<()> {
        self.image_bytes.set(self.image_bytes.get() + bytes as u64);
        let max = self.limits.unpacked_bytes;
        if self.image_bytes.get() > max {
            self.refuse(format!(
                "the image's layers have more than {max} bytes, counting a layer each time that it is named"
            ))
            .map_err(to_io_error)?;
        }
        Ok(())
    }

    /// Counts a lookup of a name, or of a path, in an image's root.
    pub(super) fn count_lookup(&self, bytes: usize) -> Result<(), BundleError> {
        let lookup_bytes = self.lookup_bytes.get() + bytes as u64 + EXTRA_BYTES_PER_NAME;
        self.lookup_bytes.set(lookup_bytes);
        if lookup_bytes > MAX_LOOKUP_BYTES {
            return self
                .refuse("the image's paths lead through too many folders and links".to_owned());
        }
        self.check()
    }

    /// Counts a name that is compared while following a link, or the target of a link.
    pub(super) fn count_link_bytes(&self, bytes: usize) -> Result<(), BundleError> {
        let link_bytes = self.link_bytes.get() + bytes as u64 + EXTRA_BYTES_PER_NAME;
        self.link_bytes.set(link_bytes);
        if link_bytes > MAX_LINK_BYTES {
            return self.refuse("the archive's links lead through too many others".to_owned());
        }
        self.check()
    }

    /// Raises the limit of read bytes: by the size of the next file, or by the size of an archive that is read in
    /// place.
    pub(super) fn allow(&self, bytes: u64) {
        self.allowed_bytes
            .set(self.allowed_bytes.get().saturating_add(bytes));
    }

    fn count_stream(&self) -> Result<(), BundleError> {
        self.streams.set(self.streams.get() + 1);
        let max = MAX_STREAMS.max(self.max_entries());
        if self.streams.get() > max {
            return self.refuse(format!(
                "the archive is made of more than {max} compressed streams"
            ));
        }
        self.check()
    }

    /// Refuses compressed data that is larger than its content: empty blocks cost as much time as others.
    fn check_compression(&self) -> Result<(), BundleError> {
        let allowed_overhead = OVERHEAD_BYTES + (self.streams.get() + 1) * PACKED_BYTES_PER_STREAM;
        let max = self
            .decompressed_bytes
            .get()
            .saturating_add(allowed_overhead);
        if self.packed_bytes.get() > max {
            return self.refuse(format!(
                "the archive is larger than its content: {} compressed bytes contain {} bytes",
                self.packed_bytes.get(),
                self.decompressed_bytes.get()
            ));
        }
        self.check()
    }
}

/// Converts to an error of a reader; the budget keeps the original.
fn to_io_error(error: BundleError) -> io::Error {
    io::Error::other(error.to_string())
}

/// A reader that counts its bytes.
pub(super) struct MeteredReader<'a, R> {
    inner: R,
    budget: &'a Budget<'a>,
}

impl<'a, R> MeteredReader<'a, R> {
    pub(super) const fn new(inner: R, budget: &'a Budget<'a>) -> Self {
        Self { inner, budget }
    }
}

impl<R: Read> Read for MeteredReader<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.budget.check().map_err(to_io_error)?;
        let read = self.inner.read(buffer)?;
        self.budget
            .read_bytes
            .set(self.budget.read_bytes.get() + read as u64);
        Ok(read)
    }
}

impl<R: Seek> Seek for MeteredReader<'_, R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.budget
            .read_bytes
            .set(self.budget.read_bytes.get() + SEEK_BYTES);
        self.budget.check().map_err(to_io_error)?;
        self.inner.seek(to)
    }
}

/// A reader that only checks for cancellation and timeout. For the compressed side: every byte is read once, and many
/// bytes may be read before the decompressor returns one.
pub(super) struct CancellableReader<'a, R> {
    inner: R,
    budget: &'a Budget<'a>,
}

impl<'a, R> CancellableReader<'a, R> {
    pub(super) const fn new(inner: R, budget: &'a Budget<'a>) -> Self {
        Self { inner, budget }
    }
}

impl<R: Read> Read for CancellableReader<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.budget.check().map_err(to_io_error)?;
        self.inner.read(buffer)
    }
}

/// A decompressor of one stream, in a file that may contain several successive streams.
pub(super) trait StreamDecoder<R>: Read + Sized {
    fn begin(packed: R) -> io::Result<Self>;
    fn into_packed(self) -> R;
}

impl<R: BufRead> StreamDecoder<R> for flate2::bufread::GzDecoder<R> {
    fn begin(packed: R) -> io::Result<Self> {
        Ok(Self::new(packed))
    }

    fn into_packed(self) -> R {
        self.into_inner()
    }
}

impl<R: BufRead> StreamDecoder<R> for zstd::Decoder<'static, R> {
    fn begin(packed: R) -> io::Result<Self> {
        Ok(Self::with_buffer(packed)?.single_frame())
    }

    fn into_packed(self) -> R {
        self.finish()
    }
}

/// Input of a decompressor, with its bytes counted.
pub(super) struct PackedInput<'a, R> {
    inner: R,
    budget: &'a Budget<'a>,
}

impl<R: BufRead> Read for PackedInput<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.fill_buf()?.read(buffer)?;
        self.consume(read);
        Ok(read)
    }
}

impl<R: BufRead> BufRead for PackedInput<'_, R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.budget.check_compression().map_err(to_io_error)?;
        self.inner.fill_buf()
    }

    fn consume(&mut self, bytes: usize) {
        self.budget
            .packed_bytes
            .set(self.budget.packed_bytes.get() + bytes as u64);
        self.inner.consume(bytes);
    }
}

/// All successive streams of a file as one. Each stream is counted, because starting an empty one also costs time.
pub(super) struct MultiStreamReader<'a, R, M> {
    budget: &'a Budget<'a>,
    /// `None` after the end, or an error.
    current: Option<M>,
    packed: std::marker::PhantomData<R>,
}

impl<'a, R: BufRead, M: StreamDecoder<PackedInput<'a, R>>> MultiStreamReader<'a, R, M> {
    pub(super) fn new(packed: R, budget: &'a Budget<'a>) -> io::Result<Self> {
        let packed = PackedInput {
            inner: packed,
            budget,
        };
        Ok(Self {
            budget,
            current: Some(M::begin(packed)?),
            packed: std::marker::PhantomData,
        })
    }
}

impl<'a, R: BufRead, M: StreamDecoder<PackedInput<'a, R>>> Read for MultiStreamReader<'a, R, M> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        while let Some(decoder) = &mut self.current {
            let read = decoder.read(buffer)?;
            if read > 0 {
                let decompressed = &self.budget.decompressed_bytes;
                decompressed.set(decompressed.get() + read as u64);
                return Ok(read);
            }
            self.budget.count_stream().map_err(to_io_error)?;
            let Some(mut packed) = self.current.take().map(StreamDecoder::into_packed) else {
                break;
            };
            if has_next_stream(&mut packed)? {
                self.current = Some(M::begin(packed)?);
            }
        }
        Ok(0)
    }
}

/// Does another stream follow? Zeros pad the blocks of tapes, and are skipped.
fn has_next_stream(packed: &mut impl BufRead) -> io::Result<bool> {
    loop {
        let next_bytes = packed.fill_buf()?;
        let zeros = next_bytes.iter().take_while(|&&byte| byte == 0).count();
        if zeros < next_bytes.len() || zeros == 0 {
            let has_more = !next_bytes.is_empty();
            packed.consume(zeros);
            return Ok(has_more);
        }
        packed.consume(zeros);
    }
}

#[cfg(test)]
mod tests;
