//! A pack: a file of clips (recordings of episodes or of parts of a game for replays) with an index for random access.
//!
//! ```text
//! 16 bytes   "faceoff-clips/1\n"
//! clips, each gzip-compressed
//! index of clips, sorted by kind, contest and number: 20 bytes a clip
//!            kind u8 · contest u8 · 0 · 0 · number u32 · offset u64 · length u32 (all little-endian)
//! 16 bytes   offset of the index u64 · clips u32 · "clip"
//! ```
//!
//! | field   | values                                                                                     |
//! |---------|--------------------------------------------------------------------------------------------|
//! | kind    | 0 index of episodes (their summaries), 1 motion, 2 observations of the (first) side, 3 of the second side     |
//! | contest | 0 hit, 1 defend, 2 prepare, 3 game                                                         |
//! | number  | the episode; in a game the chunk, which is a part of 500 control steps                     |

use crate::{clip_index::ClipIndex, error::ReplayError};
use faceoff_sim::AirHockeyTask;
use faceoff_types::{Side, Task};
use fs_err::File;
use std::{
    collections::{BTreeSet, HashSet},
    io::Write,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

/// First bytes of a pack.
const MAGIC: &[u8; 16] = b"faceoff-clips/1\n";
/// Last bytes of a pack.
const END: &[u8; 4] = b"clip";
/// Size of an entry of the index.
const ENTRY_BYTES: usize = 20;
const FOOTER_BYTES: u64 = 16;
/// Maximum number of clips in a pack; their index has 20 MB.
const MAX_CLIPS: u32 = 1 << 20;

/// Identifies a clip in a pack.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClipKey {
    kind: u8,
    contest: u8,
    number: u32,
}

impl ClipKey {
    /// The index of episodes ([`ClipIndex`]), which is stored like a clip.
    const INDEX: Self = Self {
        kind: 0,
        contest: 0,
        number: 0,
    };

    /// The public motion of an episode.
    #[must_use]
    pub fn motion(task: Task, episode: u32) -> Self {
        Self {
            kind: KIND_MOTION,
            contest: contest(task),
            number: episode,
        }
    }

    /// The agent's observations and commands in an episode.
    #[must_use]
    pub fn observed(task: Task, episode: u32) -> Self {
        Self {
            kind: KIND_OBSERVED,
            contest: contest(task),
            number: episode,
        }
    }

    /// The public motion of a game: 500 control steps from `500 × chunk` on.
    #[must_use]
    pub const fn game_motion(chunk: u32) -> Self {
        Self {
            kind: KIND_MOTION,
            contest: CONTEST_GAME,
            number: chunk,
        }
    }

    /// A side's observations and commands in a game: 500 control steps from `500 × chunk` on.
    #[must_use]
    pub const fn game_observed(side: Side, chunk: u32) -> Self {
        Self {
            kind: match side {
                Side::First => KIND_OBSERVED,
                Side::Second => KIND_OBSERVED_BY_SECOND,
            },
            contest: CONTEST_GAME,
            number: chunk,
        }
    }
}

const KIND_MOTION: u8 = 1;
const KIND_OBSERVED: u8 = 2;
const KIND_OBSERVED_BY_SECOND: u8 = 3;
const CONTEST_GAME: u8 = 3;

/// For tasks that are not in the table above; no clip has it.
const CONTEST_NONE: u8 = u8::MAX;

fn contest(task: Task) -> u8 {
    match AirHockeyTask::try_from(task) {
        Ok(AirHockeyTask::Hit) => 0,
        Ok(AirHockeyTask::Defend) => 1,
        Ok(AirHockeyTask::Prepare) => 2,
        Err(_) => CONTEST_NONE,
    }
}

/// An entry of the index of clips: where a clip lies in the file.
#[derive(Debug, Clone, Copy)]
struct Entry {
    key: ClipKey,
    offset: u64,
    length: u32,
}

impl Entry {
    fn bytes(&self) -> [u8; ENTRY_BYTES] {
        let mut bytes = [0; ENTRY_BYTES];
        bytes[0] = self.key.kind;
        bytes[1] = self.key.contest;
        bytes[4..8].copy_from_slice(&self.key.number.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.offset.to_le_bytes());
        bytes[16..].copy_from_slice(&self.length.to_le_bytes());
        bytes
    }

    fn from_bytes(bytes: &[u8; ENTRY_BYTES]) -> Self {
        let [kind, contest, _, _, rest @ ..] = bytes;
        let (number, rest) = rest.split_first_chunk().unwrap_or((&[0; 4], &[]));
        let (offset, rest) = rest.split_first_chunk().unwrap_or((&[0; 8], &[]));
        let (length, _) = rest.split_first_chunk().unwrap_or((&[0; 4], &[]));
        Self {
            key: ClipKey {
                kind: *kind,
                contest: *contest,
                number: u32::from_le_bytes(*number),
            },
            offset: u64::from_le_bytes(*offset),
            length: u32::from_le_bytes(*length),
        }
    }
}

/// Writes a pack.
#[derive(Debug)]
pub struct PackWriter<W> {
    out: W,
    bytes_written: u64,
    index: Vec<Entry>,
}

impl<W: Write> PackWriter<W> {
    /// Starts a pack.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn new(mut out: W) -> Result<Self, ReplayError> {
        out.write_all(MAGIC)?;
        Ok(Self {
            out,
            bytes_written: MAGIC.len() as u64,
            index: Vec::new(),
        })
    }

    /// Adds a clip's compressed bytes.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn add(&mut self, key: ClipKey, compressed: &[u8]) -> Result<(), ReplayError> {
        let length = u32::try_from(compressed.len())
            .map_err(|_| ReplayError::unreadable("a clip", "it is longer than 4 GB"))?;
        self.out.write_all(compressed)?;
        self.index.push(Entry {
            key,
            offset: self.bytes_written,
            length,
        });
        self.bytes_written += u64::from(length);
        Ok(())
    }

    /// Copies clips of another pack.
    fn copy(
        &mut self,
        pack: &Pack,
        is_wanted: impl Fn(ClipKey) -> bool,
    ) -> Result<(), ReplayError> {
        for entry in pack.index.iter().filter(|entry| is_wanted(entry.key)) {
            if let Some(bytes) = pack.clip(entry.key)? {
                self.add(entry.key, &bytes)?;
            }
        }
        Ok(())
    }

    /// Adds the index of the pack's episodes.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn add_index(&mut self, index: &ClipIndex) -> Result<(), ReplayError> {
        self.add(ClipKey::INDEX, &index.compressed()?)
    }

    /// Writes the file's index of clips.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn finish(mut self) -> Result<W, ReplayError> {
        self.index.sort_by_key(|entry| entry.key);
        for entry in &self.index {
            self.out.write_all(&entry.bytes())?;
        }
        let count = u32::try_from(self.index.len())
            .ok()
            .filter(|count| *count <= MAX_CLIPS)
            .ok_or_else(|| ReplayError::unreadable("a pack", "it has too many clips"))?;
        self.out.write_all(&self.bytes_written.to_le_bytes())?;
        self.out.write_all(&count.to_le_bytes())?;
        self.out.write_all(END)?;
        Ok(self.out)
    }
}

/// Reads a pack. Its index of clips is read when it is opened.
#[derive(Debug)]
pub struct Pack {
    path: PathBuf,
    file: File,
    index: Vec<Entry>,
}

impl Pack {
    /// Opens a file.
    ///
    /// # Errors
    /// [`ReplayError::Io`]; [`ReplayError::Unreadable`] if it is not a pack of this version, or truncated.
    pub fn open(path: &Path) -> Result<Self, ReplayError> {
        let wrong = |reason: &str| ReplayError::unreadable(path.display().to_string(), reason);
        let file = File::open(path)?;
        let bytes = file.metadata()?.len();
        let shortest = MAGIC.len() as u64 + FOOTER_BYTES;
        if bytes < shortest {
            return Err(wrong("it is cut off"));
        }
        let mut magic = [0; MAGIC.len()];
        file.file().read_exact_at(&mut magic, 0)?;
        if &magic != MAGIC {
            return Err(wrong("it is not a pack of clips"));
        }
        let mut offset = [0; 8];
        let mut count = [0; 4];
        let mut end = [0; 4];
        let footer = bytes - FOOTER_BYTES;
        file.file().read_exact_at(&mut offset, footer)?;
        file.file().read_exact_at(&mut count, footer + 8)?;
        file.file().read_exact_at(&mut end, footer + 12)?;
        let (offset, count) = (u64::from_le_bytes(offset), u32::from_le_bytes(count));
        let index_bytes = u64::from(count) * ENTRY_BYTES as u64;
        if &end != END || count > MAX_CLIPS || offset.checked_add(index_bytes) != Some(footer) {
            return Err(wrong("it is cut off, or its end is damaged"));
        }
        let mut index_bytes = vec![0; usize::try_from(index_bytes).unwrap_or_default()];
        file.file().read_exact_at(&mut index_bytes, offset)?;
        let (entries, _) = index_bytes.as_chunks::<ENTRY_BYTES>();
        let index: Vec<Entry> = entries.iter().map(Entry::from_bytes).collect();
        let lies_before_index = |entry: &Entry| {
            let end = entry.offset.checked_add(u64::from(entry.length));
            entry.offset >= MAGIC.len() as u64 && end.is_some_and(|end| end <= offset)
        };
        if !index.iter().all(lies_before_index) || !index.is_sorted_by(|a, b| a.key < b.key) {
            return Err(wrong("its index is damaged"));
        }
        Ok(Self {
            path: path.to_owned(),
            file,
            index,
        })
    }

    /// A clip's compressed bytes; `None` if the pack has no such clip.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn clip(&self, key: ClipKey) -> Result<Option<Vec<u8>>, ReplayError> {
        let found = self.index.binary_search_by_key(&key, |entry| entry.key);
        let Some(entry) = found.ok().map(|index| self.index[index]) else {
            return Ok(None);
        };
        let mut bytes = vec![0; usize::try_from(entry.length).unwrap_or_default()];
        self.file.file().read_exact_at(&mut bytes, entry.offset)?;
        Ok(Some(bytes))
    }

    /// The index of the pack's episodes.
    ///
    /// # Errors
    /// [`ReplayError`].
    pub fn clip_index(&self) -> Result<ClipIndex, ReplayError> {
        match self.clip(ClipKey::INDEX)? {
            Some(bytes) => ClipIndex::read(&bytes),
            None => Err(ReplayError::unreadable(
                self.path.display().to_string(),
                "it has no index of episodes",
            )),
        }
    }
}

/// Joins the packs of an evaluation's shards, each of which has a range of episodes of one task.
///
/// # Errors
/// [`ReplayError`].
pub fn join_packs<W: Write>(packs: &[PathBuf], out: W) -> Result<W, ReplayError> {
    let (mut writer, mut index) = (PackWriter::new(out)?, ClipIndex::default());
    for path in packs {
        let pack = Pack::open(path)?;
        writer.copy(&pack, |key| key != ClipKey::INDEX)?;
        index.merge(pack.clip_index()?);
    }
    writer.add_index(&index)?;
    writer.finish()
}

/// Joins the packs of an evaluation's shards with only the selected episodes, and without the histogram of computation
/// times.
///
/// # Errors
/// [`ReplayError`].
pub fn select_episodes<W: Write>(
    packs: &[PathBuf],
    selected: &HashSet<(Task, u32)>,
    out: W,
) -> Result<W, ReplayError> {
    let episode_keys = |(task, episode): &(Task, u32)| {
        [
            ClipKey::motion(*task, *episode),
            ClipKey::observed(*task, *episode),
        ]
    };
    let keys: BTreeSet<ClipKey> = selected.iter().flat_map(episode_keys).collect();
    let mut writer = PackWriter::new(out)?;
    for path in packs {
        writer.copy(&Pack::open(path)?, |key| keys.contains(&key))?;
    }
    let mut index = merged_index(packs)?;
    index
        .episodes
        .retain(|summary| selected.contains(&(summary.task, summary.episode)));
    index.times.clear();
    writer.add_index(&index)?;
    writer.finish()
}

/// The merged index of an evaluation's shards.
///
/// # Errors
/// [`ReplayError`].
pub fn merged_index(packs: &[PathBuf]) -> Result<ClipIndex, ReplayError> {
    let mut index = ClipIndex::default();
    for path in packs {
        index.merge(Pack::open(path)?.clip_index()?);
    }
    Ok(index)
}
