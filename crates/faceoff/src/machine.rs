//! Properties of this machine that agents notice, and resource usage of this process.

use faceoff_metrics::Process;
use faceoff_sandbox::affinity;
use faceoff_types::AgentMachine;
use std::fs;

/// The machine as seen by agents that are bound to `cpus`. Without any, agents use all CPUs of this process.
#[must_use]
pub fn agent_machine(cpus: &[usize]) -> AgentMachine {
    let count = match cpus {
        [] => affinity::allowed_cpus().map_or(1, |cpus| cpus.len()),
        cpus => cpus.len(),
    };
    AgentMachine {
        architecture: std::env::consts::ARCH.to_owned(),
        cpu_model: cpu_model(&fs::read_to_string("/proc/cpuinfo").unwrap_or_default()),
        cpus_per_agent: u32::try_from(count).unwrap_or(u32::MAX),
    }
}

/// Resource usage of this process; unknown values are 0.
#[must_use]
pub fn process() -> Process {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let open = fs::read_dir("/proc/self/fd").map_or(0, Iterator::count);
    let limit = rustix::process::getrlimit(rustix::process::Resource::Nofile);
    Process {
        resident_bytes: resident_bytes(&status).unwrap_or_default(),
        open_fds: open as u64,
        max_fds: limit.current.unwrap_or(u64::MAX),
    }
}

fn resident_bytes(status: &str) -> Option<u64> {
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// The first CPU model in /proc/cpuinfo.
fn cpu_model(cpuinfo: &str) -> Option<String> {
    cpuinfo.lines().find_map(|line| {
        let (name, value) = line.split_once(':')?;
        (name.trim() == "model name").then(|| value.trim().to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cpu_model_is_read_if_the_kernel_names_it() {
        let x86 = "processor\t: 0\nmodel\t\t: 85\nmodel name\t: A CPU @ 2 GHz\n\nprocessor\t: 1\n";
        assert_eq!(cpu_model(x86).as_deref(), Some("A CPU @ 2 GHz"));
        assert_eq!(cpu_model("processor\t: 0\nFeatures\t: fp\n"), None);
        assert_eq!(agent_machine(&[4, 5]).cpus_per_agent, 2);
        assert!(agent_machine(&[]).cpus_per_agent >= 1);
    }

    #[test]
    fn process_usage_is_read() {
        assert_eq!(
            resident_bytes("Name:\tx\nVmRSS:\t  12 kB\n"),
            Some(12 * 1024)
        );
        let Process {
            resident_bytes,
            open_fds,
            max_fds,
        } = process();
        assert!(resident_bytes > 0 && open_fds > 0 && max_fds >= open_fds);
    }
}
