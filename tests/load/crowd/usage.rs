//! Resource usage of processes and threads, from /proc.

use anyhow::Context as _;
use std::{collections::BTreeMap, fs};

/// Linux reports CPU time in hundredths of a second (`USER_HZ`), whatever its internal clock.
const TICKS_PER_S: f64 = 100.0;

/// The usage of a process since its start.
#[derive(Debug, Clone)]
pub(crate) struct Usage {
    /// CPU seconds, user and system, without its children.
    pub(crate) cpu_s: f64,
    /// Memory in use, bytes.
    pub(crate) resident_bytes: u64,
    /// The highest memory use, bytes.
    pub(crate) peak_bytes: u64,
    /// Bytes that it wrote to disks.
    pub(crate) written_bytes: u64,
}

/// Names and CPU seconds of a process's threads, by thread id and start time, since ids are used again. A thread that has ended keeps
/// its last value.
#[derive(Debug, Clone, Default)]
pub(crate) struct Threads(BTreeMap<(u32, u64), (String, f64)>);

/// Fields of a `stat` file of a process or thread.
struct Stat {
    name: String,
    cpu_s: f64,
    /// Ticks since the machine's start.
    started: u64,
}

impl Usage {
    pub(crate) fn of(process: u32) -> anyhow::Result<Self> {
        let folder = format!("/proc/{process}");
        let read = |name: &str| {
            let path = format!("{folder}/{name}");
            fs::read_to_string(&path).with_context(|| format!("reading {path}"))
        };
        let (status, io) = (read("status")?, read("io")?);
        Ok(Self {
            cpu_s: stat(&read("stat")?)?.cpu_s,
            resident_bytes: number(&status, "VmRSS:")? * 1024,
            peak_bytes: number(&status, "VmHWM:")? * 1024,
            written_bytes: number(&io, "write_bytes:")?,
        })
    }
}

impl Threads {
    /// Reads the values of all running threads.
    pub(crate) fn sample(&mut self, process: u32) -> anyhow::Result<()> {
        let folder = format!("/proc/{process}/task");
        for entry in fs::read_dir(&folder).with_context(|| format!("reading {folder}"))? {
            let entry = entry?;
            let id: u32 = entry
                .file_name()
                .to_string_lossy()
                .parse()
                .context("a thread's id")?;
            // A thread that has ended meanwhile has no file.
            if let Ok(text) = fs::read_to_string(entry.path().join("stat")) {
                let Stat {
                    name,
                    cpu_s,
                    started,
                } = stat(&text)?;
                self.0.insert((id, started), (name, cpu_s));
            }
        }
        Ok(())
    }

    /// CPU seconds since `before`, by the threads' names.
    pub(crate) fn since(&self, before: &Self) -> BTreeMap<String, f64> {
        let mut by_name = BTreeMap::new();
        for (thread, (name, cpu_s)) in &self.0 {
            let earlier_cpu_s = before.0.get(thread).map_or(0.0, |(_, cpu_s)| *cpu_s);
            *by_name.entry(name.clone()).or_insert(0.0) += cpu_s - earlier_cpu_s;
        }
        by_name
    }
}

/// A `stat` of proc(5). The name is in parentheses and may hold any character.
fn stat(text: &str) -> anyhow::Result<Stat> {
    let (start, end) = text
        .find('(')
        .zip(text.rfind(')'))
        .context("a stat without a name")?;
    let fields: Vec<&str> = text[end + 1..].split_whitespace().collect();
    // The first of these is the third of the file.
    let field = |number: usize| -> anyhow::Result<u64> {
        let field = fields.get(number - 3).context("a short stat")?;
        field.parse().with_context(|| format!("field {number}"))
    };
    Ok(Stat {
        name: text[start + 1..end].to_owned(),
        cpu_s: (field(14)? + field(15)?) as f64 / TICKS_PER_S,
        started: field(22)?,
    })
}

/// The number in the line that begins with `name`.
fn number(text: &str, name: &str) -> anyhow::Result<u64> {
    let mut found = text.lines().filter_map(|line| line.strip_prefix(name));
    let value = found.next().and_then(|rest| rest.split_whitespace().next());
    let value = value.with_context(|| format!("the kernel does not report {name}"))?;
    value.parse().with_context(|| format!("{name} {value}"))
}
