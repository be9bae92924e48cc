//! What unpacking may cost, whatever the archive is made of.

use super::error::BundleError;
use faceoff_types::BundleLimits;
use std::{
    cell::{Cell, RefCell},
    io::{self, BufRead, Read, Seek, SeekFrom},
    time::{Duration, Instant},
};

/// How much may be read of an archive beside its files' contents (headers, long names, extended
/// attributes, padding, directories), in bytes, before it has brought a single entry …
const BESIDE_BYTES: u64 = 16 << 20;
/// … and how much more for each entry: a header with its padding, and as much to describe it.
const BESIDE_BYTES_PER_ENTRY: u64 = 2 << 10;
/// A file or a folder, each with a header of its own before it, is two entries; so this many for each
/// that is allowed.
const ENTRIES_PER_FILE: u64 = 4;
/// A seek costs a call of the system and a buffer filled anew, so it counts as bytes, too.
const SEEK_BYTES: u64 = 64;
/// How often one stream may be followed by another one in the same file. `bgzip` begins anew every
/// 64 KiB; layers that can be fetched piece by piece have a stream for each file, or some, so that there are
/// as many of these as there may be entries, if that is more.
const MEMBERS: u64 = 1 << 16;
/// What compressors add to a stream, in bytes: its header, and what some note there. Beyond this and
/// [`BESIDE_BYTES`] nothing that is compressed is larger than what it holds.
const PACKED_BYTES_PER_MEMBER: u64 = 1 << 10;
/// How much of names may be compared to follow all links, in bytes.
const LINK_BYTES: u64 = 128 << 20;
/// How much of names may be looked up to place the entries of an image's layers, in bytes. A hundred thousand
/// entries of ordinary paths come to a tenth of it.
const LOOKED_UP_BYTES: u64 = 256 << 20;
/// A name costs as much as so many bytes, however short it is.
const LOOKED_UP_AT_LEAST: u64 = 16;

/// Tells the time; given from outside so that a test turns it.
pub(super) type Now<'a> = &'a dyn Fn() -> Instant;

/// Counts everything that reading an archive makes us do, and ends it where a limit is met: bytes that
/// come out of the decompressor, entries of any kind, streams one after another, seeks. All of that
/// depends on the archive alone, so that the verdict on it does not depend on how fast the host is.
/// Time is the last line: it ends what our own count has missed, or a host that stands still, and is
/// therefore our fault and not the archive's.
///
/// The reasons are kept here, since a library between us and the reader may put an error of its own in
/// the place of ours.
pub(super) struct Budget<'a> {
    limits: BundleLimits,
    until: Instant,
    now: Now<'a>,
    cancelled: &'a dyn Fn() -> bool,
    /// Read through [`Metered`], in bytes: everything that the archive is made of.
    read: Cell<u64>,
    /// How much that may be by now.
    allowed: Cell<u64>,
    /// What became files, in bytes.
    content: Cell<u64>,
    /// What an archive's directory says that files have, in bytes.
    stated: Cell<u64>,
    entries: Cell<u64>,
    members: Cell<u64>,
    /// Taken in by decompressors, in bytes …
    packed: Cell<u64>,
    /// … and what they made of it.
    decompressed: Cell<u64>,
    link_bytes: Cell<u64>,
    looked_up: Cell<u64>,
    /// Of an image's files, in bytes.
    of_image: Cell<u64>,
    /// What comes now is of an image's layers.
    is_root: Cell<bool>,
    ended: RefCell<Option<BundleError>>,
}

impl<'a> Budget<'a> {
    /// A budget that is all to be spent. `cancelled` is asked for every piece that is read, so it must be
    /// cheap.
    pub(super) fn new(
        limits: &BundleLimits,
        now: Now<'a>,
        cancelled: &'a dyn Fn() -> bool,
    ) -> Self {
        Self {
            limits: *limits,
            until: now() + Duration::from_secs(limits.unpack_s.into()),
            now,
            cancelled,
            read: Cell::new(0),
            allowed: Cell::new(BESIDE_BYTES),
            content: Cell::new(0),
            stated: Cell::new(0),
            entries: Cell::new(0),
            members: Cell::new(0),
            packed: Cell::new(0),
            decompressed: Cell::new(0),
            link_bytes: Cell::new(0),
            looked_up: Cell::new(0),
            of_image: Cell::new(0),
            is_root: Cell::new(false),
            ended: RefCell::new(None),
        }
    }

    pub(super) const fn limits(&self) -> &BundleLimits {
        &self.limits
    }

    /// The reason why nothing more may be done, in place of what `done` says of it.
    pub(super) fn verdict<T>(&self, done: Result<T, BundleError>) -> Result<T, BundleError> {
        match (done, self.ended.take()) {
            (Err(_), Some(reason)) => Err(reason),
            (done, _) => done,
        }
    }

    fn end(&self, reason: BundleError) -> BundleError {
        let told = reason.to_string();
        self.ended.borrow_mut().get_or_insert(reason);
        BundleError::Invalid(told)
    }

    fn refuse(&self, reason: String) -> Result<(), BundleError> {
        Err(self.end(BundleError::Invalid(reason)))
    }

    /// Asked before each piece of work.
    pub(super) fn check(&self) -> Result<(), BundleError> {
        if self.ended.borrow().is_some() {
            return Err(BundleError::Cancelled);
        }
        if (self.cancelled)() {
            return Err(self.end(BundleError::Cancelled));
        }
        if (self.now)() > self.until {
            return Err(self.end(BundleError::Io(io::Error::new(
                io::ErrorKind::TimedOut,
                format!(
                    "unpacking took longer than {} s, which nothing in the archive explains: the host is \
                     too slow, or stands still",
                    self.limits.unpack_s
                ),
            ))));
        }
        let (read, allowed) = (self.read.get(), self.allowed.get());
        if read > allowed {
            return self.refuse(format!(
                "the archive is more than its files explain: after {read} bytes of it there were {} entries, \
                 with which at most {allowed} bytes of contents, headers, names and padding are allowed",
                self.entries.get(),
            ));
        }
        Ok(())
    }

    /// Another entry of the archive, whatever its kind: also one that only describes the next.
    pub(super) fn entry(&self) -> Result<(), BundleError> {
        let most = self.most_entries();
        self.entries.set(self.entries.get() + 1);
        self.allow(BESIDE_BYTES_PER_ENTRY);
        if self.entries.get() > most {
            return self.refuse(format!(
                "the archive has more than {most} entries of all kinds"
            ));
        }
        self.check()
    }

    fn most_entries(&self) -> u64 {
        self.limits.files.saturating_mul(ENTRIES_PER_FILE)
    }

    /// What became part of a file, or was read as the content of one that is left out.
    pub(super) fn content(&self, entry: &str, bytes: usize) -> Result<(), BundleError> {
        self.content.set(self.content.get() + bytes as u64);
        self.check_content(entry, self.content.get())
    }

    /// What an archive's directory says of a file, none of which has been read.
    pub(super) fn stated(&self, entry: &str, bytes: u64) -> Result<(), BundleError> {
        self.stated.set(self.stated.get().saturating_add(bytes));
        self.check_content(entry, self.stated.get())
    }

    fn check_content(&self, entry: &str, bytes: u64) -> Result<(), BundleError> {
        let most = self.limits.unpacked_bytes;
        if bytes > most {
            return self.refuse(if self.is_root.get() {
                format!(
                    "what the image's layers hold comes to more than {most} bytes (stopped at entry {entry:?}): \
                     begin with a smaller image, and install and clean up in one step"
                )
            } else {
                format!(
                    "the archive unpacks to more than {most} bytes (stopped at entry {entry:?})"
                )
            });
        }
        Ok(())
    }

    /// The layers of an image have been unpacked as files, and are now unpacked themselves: their content has the
    /// limit for itself. All else is counted on.
    pub(super) fn begin_root(&self) {
        self.content.set(0);
        self.is_root.set(true);
    }

    /// What is read of an image's files, as they came. Each is needed once, and all of them have the limit of the
    /// unpacked bytes; one that is named again and again is read as often.
    pub(super) fn of_image(&self, bytes: usize) -> io::Result<()> {
        self.of_image.set(self.of_image.get() + bytes as u64);
        let most = self.limits.unpacked_bytes;
        if self.of_image.get() > most {
            self.refuse(format!(
                "the image's layers have more than {most} bytes, those that it names twice counted twice"
            ))
            .map_err(as_io)?;
        }
        Ok(())
    }

    /// A name that is looked up in an image's root, or a path that is looked at there.
    pub(super) fn looked_up(&self, bytes: usize) -> Result<(), BundleError> {
        let looked_up = self.looked_up.get() + bytes as u64 + LOOKED_UP_AT_LEAST;
        self.looked_up.set(looked_up);
        if looked_up > LOOKED_UP_BYTES {
            return self
                .refuse("the image's paths lead through too many folders and links".to_owned());
        }
        self.check()
    }

    /// A name that is compared to follow a link, or the target of one.
    pub(super) fn followed(&self, bytes: usize) -> Result<(), BundleError> {
        let followed = self.link_bytes.get() + bytes as u64 + LOOKED_UP_AT_LEAST;
        self.link_bytes.set(followed);
        if followed > LINK_BYTES {
            return self.refuse("the archive's links lead through too many others".to_owned());
        }
        self.check()
    }

    /// So many bytes more may be read: the contents of a file that comes now, or all of a packed archive
    /// that is read where it lies.
    pub(super) fn allow(&self, bytes: u64) {
        self.allowed.set(self.allowed.get().saturating_add(bytes));
    }

    fn member(&self) -> Result<(), BundleError> {
        self.members.set(self.members.get() + 1);
        let most = MEMBERS.max(self.most_entries());
        if self.members.get() > most {
            return self.refuse(format!(
                "the archive is made of more than {most} compressed streams"
            ));
        }
        self.check()
    }

    /// Blocks that decompress to nothing cost as much as any.
    fn decompresses(&self) -> Result<(), BundleError> {
        let explained = BESIDE_BYTES + (self.members.get() + 1) * PACKED_BYTES_PER_MEMBER;
        if self.packed.get() > self.decompressed.get().saturating_add(explained) {
            return self.refuse(format!(
                "the archive is larger than what it holds: {} compressed bytes have brought {}",
                self.packed.get(),
                self.decompressed.get()
            ));
        }
        self.check()
    }
}

/// As an error of a reader; what it says is kept by the budget.
fn as_io(error: BundleError) -> io::Error {
    io::Error::other(error.to_string())
}

/// A reader whose bytes are counted.
pub(super) struct Metered<'a, R> {
    inner: R,
    budget: &'a Budget<'a>,
}

impl<'a, R> Metered<'a, R> {
    pub(super) const fn new(inner: R, budget: &'a Budget<'a>) -> Self {
        Self { inner, budget }
    }
}

impl<R: Read> Read for Metered<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.budget.check().map_err(as_io)?;
        let read = self.inner.read(buffer)?;
        self.budget.read.set(self.budget.read.get() + read as u64);
        Ok(read)
    }
}

impl<R: Seek> Seek for Metered<'_, R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.budget.read.set(self.budget.read.get() + SEEK_BYTES);
        self.budget.check().map_err(as_io)?;
        self.inner.seek(to)
    }
}

/// A reader that only asks whether to go on: for the packed side, of which every byte is read once, and
/// which may be long before a byte comes out at the other.
pub(super) struct Watched<'a, R> {
    inner: R,
    budget: &'a Budget<'a>,
}

impl<'a, R> Watched<'a, R> {
    pub(super) const fn new(inner: R, budget: &'a Budget<'a>) -> Self {
        Self { inner, budget }
    }
}

impl<R: Read> Read for Watched<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.budget.check().map_err(as_io)?;
        self.inner.read(buffer)
    }
}

/// What decompresses one stream of a file that may hold several, one after another.
pub(super) trait Member<R>: Read + Sized {
    fn begin(packed: R) -> io::Result<Self>;
    fn packed(self) -> R;
}

impl<R: BufRead> Member<R> for flate2::bufread::GzDecoder<R> {
    fn begin(packed: R) -> io::Result<Self> {
        Ok(Self::new(packed))
    }

    fn packed(self) -> R {
        self.into_inner()
    }
}

impl<R: BufRead> Member<R> for zstd::Decoder<'static, R> {
    fn begin(packed: R) -> io::Result<Self> {
        Ok(Self::with_buffer(packed)?.single_frame())
    }

    fn packed(self) -> R {
        self.finish()
    }
}

/// What a decompressor takes in, counted.
pub(super) struct Packed<'a, R> {
    inner: R,
    budget: &'a Budget<'a>,
}

impl<R: BufRead> Read for Packed<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.fill_buf()?.read(buffer)?;
        self.consume(read);
        Ok(read)
    }
}

impl<R: BufRead> BufRead for Packed<'_, R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.budget.decompresses().map_err(as_io)?;
        self.inner.fill_buf()
    }

    fn consume(&mut self, bytes: usize) {
        self.budget
            .packed
            .set(self.budget.packed.get() + bytes as u64);
        self.inner.consume(bytes);
    }
}

/// All streams of a file as one, each counted: one that holds nothing costs as much to begin as any.
pub(super) struct Members<'a, R, M> {
    budget: &'a Budget<'a>,
    /// `None` after the end, or an error.
    current: Option<M>,
    packed: std::marker::PhantomData<R>,
}

impl<'a, R: BufRead, M: Member<Packed<'a, R>>> Members<'a, R, M> {
    pub(super) fn new(packed: R, budget: &'a Budget<'a>) -> io::Result<Self> {
        let packed = Packed {
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

impl<'a, R: BufRead, M: Member<Packed<'a, R>>> Read for Members<'a, R, M> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        while let Some(member) = &mut self.current {
            let read = member.read(buffer)?;
            if read > 0 {
                let decompressed = &self.budget.decompressed;
                decompressed.set(decompressed.get() + read as u64);
                return Ok(read);
            }
            self.budget.member().map_err(as_io)?;
            let Some(mut packed) = self.current.take().map(Member::packed) else {
                break;
            };
            if follows(&mut packed)? {
                self.current = Some(M::begin(packed)?);
            }
        }
        Ok(0)
    }
}

/// Is there another stream? Zeros fill up blocks of tapes, and begin none.
fn follows(packed: &mut impl BufRead) -> io::Result<bool> {
    loop {
        let ahead = packed.fill_buf()?;
        let zeros = ahead.iter().take_while(|&&byte| byte == 0).count();
        if zeros < ahead.len() || zeros == 0 {
            let is_there = !ahead.is_empty();
            packed.consume(zeros);
            return Ok(is_there);
        }
        packed.consume(zeros);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: BundleLimits = BundleLimits {
        packed_bytes: 1000,
        unpacked_bytes: 1000,
        files: 10,
        unpack_s: 60,
    };

    #[test]
    fn time_is_the_hosts_fault_and_a_cancellation_nobodys() {
        let start = Instant::now();
        let passed = Cell::new(Duration::ZERO);
        let cancelled = Cell::new(false);
        let (now, asked) = (|| start + passed.get(), || cancelled.get());
        let budget = Budget::new(&LIMITS, &now, &asked);
        let mut reader = Metered::new(io::repeat(0).take(100), &budget);
        passed.set(Duration::from_secs(60));
        assert_eq!(reader.read(&mut [0; 10]).unwrap(), 10);
        passed.set(Duration::from_secs(61));
        let broken = reader.read(&mut [0; 10]).unwrap_err();
        // However a library words it.
        let told: Result<(), _> = budget.verdict(Err(BundleError::reading("x")(broken)));
        assert!(
            matches!(&told, Err(BundleError::Io(error)) if error.kind() == io::ErrorKind::TimedOut),
            "{told:?}"
        );

        passed.set(Duration::ZERO);
        let budget = Budget::new(&LIMITS, &now, &asked);
        budget.entry().unwrap();
        cancelled.set(true);
        let told = budget.verdict(budget.entry());
        assert!(matches!(told, Err(BundleError::Cancelled)), "{told:?}");
    }

    #[test]
    fn links_of_the_shortest_names_are_counted() {
        let (now, never) = (Instant::now, || false);
        let budget = Budget::new(&LIMITS, &now, &never);
        let almost = usize::try_from(LINK_BYTES - 2 * LOOKED_UP_AT_LEAST).unwrap();
        budget.followed(almost).unwrap();
        budget.followed(0).unwrap();
        let told = budget.verdict(budget.followed(0)).unwrap_err().to_string();
        assert!(told.contains("lead through too many others"), "{told}");
    }

    #[test]
    fn what_is_beside_the_files_is_counted_whoever_reads_it() {
        let (now, never) = (Instant::now, || false);
        let budget = Budget::new(&LIMITS, &now, &never);
        let mut reader = Metered::new(io::repeat(0), &budget);
        let read = io::copy(&mut reader, &mut io::sink()).unwrap_err();
        let told = budget.verdict(Err::<(), _>(BundleError::reading("")(read)));
        let BundleError::Invalid(told) = told.unwrap_err() else {
            panic!("it is the archive's doing");
        };
        assert!(told.contains("more than its files explain"), "{told}");
        assert!(budget.read.get() < BESIDE_BYTES + (1 << 20));
    }
}
