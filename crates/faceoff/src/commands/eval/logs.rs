//! Standard error of the agent's processes. A *shard* is a range of episodes that one process at a time runs; a *fault* of the
//! agent, e.g. a crash, ends its process, and a new one continues the shard.

use faceoff_types::{AgentFault, escape_unprintable};

/// The end of the log of each shard. The output of each process is followed by the fault that ended it.
#[derive(Debug, Default)]
pub(super) struct Logs(Vec<String>);

/// Prefix of a fault in a log.
const FAULT_PREFIX: &str = "[faceoff] ";

impl Logs {
    pub(super) fn add(&mut self, log: &str) {
        self.0.push(log.to_owned());
    }

    /// All logs, concatenated.
    pub(super) fn concat(&self) -> String {
        self.0.concat()
    }

    /// The output of the process that had this fault; empty if it wrote nothing, or later output has displaced it.
    pub(super) fn lines_before(&self, fault: &AgentFault) -> Vec<&str> {
        let fault = fault.to_string();
        let first = fault.lines().next().unwrap_or_default();
        let expected = format!("{FAULT_PREFIX}{}", escape_unprintable(first));
        for log in &self.0 {
            let mut lines = Vec::new();
            for line in log.lines() {
                // In the log, the fault may be followed by the time that passed until it.
                if line.starts_with(&expected) {
                    return lines;
                }
                if line.starts_with(FAULT_PREFIX) {
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
    use faceoff_airhockey::HIT;
    use faceoff_types::AgentFaultKind;

    #[test]
    fn fault_has_the_output_of_its_own_process() {
        let fault = |episode| AgentFault {
            fault: AgentFaultKind::Exited { code: 1 },
            agent_task: HIT.into(),
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
        assert_eq!(logs.lines_before(&fault(1)), ["one"]);
        assert_eq!(logs.lines_before(&fault(2)), ["two", "three"]);
        assert_eq!(logs.lines_before(&fault(3)), [""; 0]);
        assert!(logs.concat().starts_with("of another shard\none\n"));
    }
}
