//! The CPUs that an agent sees: exactly those that it may run on, in every interface.
//!
//! Libraries count CPUs in `/sys`, in `/proc`, by affinity or by an environment variable, and start a thread for each. If these
//! counts disagree, threads wait for each other on one CPU, or try to bind to forbidden CPUs and fail.

use crate::{SpawnSpec, affinity::cpu_list, cpu_numbers::CpuNumbers};

/// Files in which libraries read the list of CPUs.
const CPU_LISTS: [&str; 3] = [
    "/sys/devices/system/cpu/online",
    "/sys/devices/system/cpu/possible",
    "/sys/devices/system/cpu/present",
];

/// Variables from which numerical libraries take their number of threads.
pub(crate) const THREAD_VARIABLES: [&str; 6] = [
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "RAYON_NUM_THREADS",
];

/// The CPUs of one agent.
#[derive(Debug)]
pub(crate) struct CpuView {
    numbers: CpuNumbers,
    /// Number of threads that numerical libraries should start.
    threads: usize,
}

impl CpuView {
    pub(crate) fn new(spec: &SpawnSpec) -> Self {
        Self::of(CpuNumbers::new(spec), spec.limits.cpus)
    }

    /// `quota`: CPU time per time that the agent may use, in CPUs, e.g. 1.5.
    fn of(numbers: CpuNumbers, quota: f64) -> Self {
        let quota = quota.ceil().max(1.0) as usize;
        Self {
            threads: numbers.count().clamp(1, quota),
            numbers,
        }
    }

    /// The CPU list files: path and content.
    pub(crate) fn lists(&self) -> impl Iterator<Item = (&'static str, Vec<u8>)> {
        let list = format!("{}\n", cpu_list(&self.numbers.all()));
        CPU_LISTS
            .map(|path| (path, list.clone().into_bytes()))
            .into_iter()
    }

    /// The thread count variables: the number of CPUs, or the CPU quota rounded up if that is less.
    pub(crate) fn variables(&self) -> impl Iterator<Item = (String, String)> {
        let threads = self.threads.to_string();
        THREAD_VARIABLES
            .map(|name| (name.to_owned(), threads.clone()))
            .into_iter()
    }

    /// The content of the host's file `path` with the agent's CPUs only, and its numbers of them.
    pub(crate) fn filter_file(&self, path: &str, content: &[u8]) -> Vec<u8> {
        let text = || String::from_utf8_lossy(content);
        match path {
            "/proc/stat" => self.filter_stat(&text()).into_bytes(),
            "/proc/cpuinfo" => self.filter_cpuinfo(&text()).into_bytes(),
            _ => content.to_vec(),
        }
    }

    fn filter_stat(&self, text: &str) -> String {
        let filter_line = |line: &str| {
            let (name, rest) = line.split_once(' ').unwrap_or((line, ""));
            let Some(Ok(cpu)) = name.strip_prefix("cpu").map(str::parse) else {
                return Some(line.to_owned());
            };
            let cpu = self.numbers.for_agent(cpu)?;
            Some(format!("cpu{cpu} {rest}"))
        };
        text.split_inclusive('\n').filter_map(filter_line).collect()
    }

    fn filter_cpuinfo(&self, text: &str) -> String {
        let filter_block = |block: &str| {
            let processor = block.lines().find_map(|line| {
                let (name, value) = line.split_once(':')?;
                let number = value.trim().parse().ok()?;
                (name.trim() == "processor").then_some((line, name, number))
            });
            let Some((line, name, number)) = processor else {
                return Some(block.to_owned());
            };
            let number = self.numbers.for_agent(number)?;
            Some(block.replacen(line, &format!("{name}: {number}"), 1))
        };
        text.split_inclusive("\n\n")
            .filter_map(filter_block)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(cpus: &[usize], quota: f64) -> CpuView {
        CpuView::of(CpuNumbers::of(cpus, true), quota)
    }

    #[test]
    fn thread_count_is_limited_by_cpus_and_quota() {
        for (cpus, quota, threads) in [
            (&[3][..], 1.0, "1"),
            (&[3], 4.0, "1"),
            (&[2, 3], 1.0, "1"),
            (&[2, 3], 1.5, "2"),
            (&[2, 3, 5], 8.0, "3"),
            (&[2], 0.01, "1"),
        ] {
            let variables: Vec<_> = view(cpus, quota).variables().collect();
            assert!(
                variables.iter().all(|(_, value)| value == threads),
                "{cpus:?} {quota} {variables:?}"
            );
        }
        assert!(view(&[], 1.0).lists().all(|(_, list)| list.len() > 1));
    }

    #[test]
    fn cpu_files_list_only_the_agents_cpus() {
        let view = view(&[1, 10], 2.0);
        let stat = "cpu  9 9\ncpu0 1 1\ncpu1 2 2\ncpu10 3 3\ncpu11 4 4\nintr 5\nctxt 6\n";
        let shown = String::from_utf8(view.filter_file("/proc/stat", stat.as_bytes())).unwrap();
        assert_eq!(shown, "cpu  9 9\ncpu0 2 2\ncpu1 3 3\nintr 5\nctxt 6\n");
        let info = "processor\t: 0\nmodel name\t: x\n\nprocessor\t: 1\nmodel name\t: x\n\n\
                    processor\t: 10\nflags\t\t: fpu\n\nHardware\t: board\n";
        let shown = String::from_utf8(view.filter_file("/proc/cpuinfo", info.as_bytes())).unwrap();
        assert_eq!(
            shown,
            "processor\t: 0\nmodel name\t: x\n\nprocessor\t: 1\nflags\t\t: fpu\n\nHardware\t: board\n"
        );
        assert_eq!(view.filter_file("/proc/uptime", b"1 2\n"), b"1 2\n");
        let lists: Vec<_> = view.lists().map(|(_, list)| list).collect();
        assert_eq!(lists, [b"0,1\n", b"0,1\n", b"0,1\n"]);
    }
}
