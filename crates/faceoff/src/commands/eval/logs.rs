//! What the agent's processes wrote to standard error.

use faceoff_types::{AgentFault, harmless};

/// Of each shard the end of it; after each process's own words stands the fault that ended it.
#[derive(Debug, Default)]
pub(super) struct Logs(Vec<String>);

/// Before a fault in a log.
const MARK: &str = "[faceoff] ";

impl Logs {
    pub(super) fn add(&mut self, log: &str) {
        self.0.push(log.to_owned());
    }

    /// One after the other.
    pub(super) fn whole(&self) -> String {
        self.0.concat()
    }

    /// The lines that the process wrote which had this fault; none if it wrote nothing, or more has been written since
    /// than is kept.
    pub(super) fn before(&self, fault: &AgentFault) -> Vec<&str> {
        let fault = fault.to_string();
        let first = fault.lines().next().unwrap_or_default();
        let told = format!("{MARK}{}", harmless(first));
        for log in &self.0 {
            let mut lines = Vec::new();
            for line in log.lines() {
                // It may go on: how long it was waited for.
                if line.starts_with(&told) {
                    return lines;
                }
                if line.starts_with(MARK) {
                    lines.clear();
                } else {
                    lines.push(line);
                }
            }
        }
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::{AgentFaultKind, Task};

    #[test]
    fn a_fault_is_told_with_what_its_own_process_wrote() {
        let fault = |episode| AgentFault {
            fault: AgentFaultKind::Exited { code: 1 },
            contest: Task::Hit.into(),
            episode: Some(episode),
            step: Some(7),
            line: None,
        };
        let mut logs = Logs::default();
        logs.add("of another shard\n");
        logs.add(&format!(
            "one\n[faceoff] {}\ntwo\nthree\n[faceoff] {} (after 0.1 s)\nfour\n",
            fault(1),
            fault(2)
        ));
        assert_eq!(logs.before(&fault(1)), ["one"]);
        assert_eq!(logs.before(&fault(2)), ["two", "three"]);
        assert_eq!(logs.before(&fault(3)), [""; 0]);
        assert!(logs.whole().starts_with("of another shard\none\n"));
    }
}
