//! The log of an agent, as its team reads it: the end of its standard error, with its faults.

use faceoff_types::escape_unprintable;

/// The end of the standard error of an agent's successive processes, with control characters escaped.
#[derive(Debug)]
pub(crate) struct Log {
    text: String,
    limit_bytes: usize,
}

impl Log {
    /// An empty log that keeps its last `limit_bytes`.
    pub fn new(limit_bytes: u64) -> Self {
        Self {
            text: String::new(),
            limit_bytes: usize::try_from(limit_bytes).unwrap_or(usize::MAX),
        }
    }

    /// Adds the output of one process, and the fault that ended it, if any.
    pub fn add(&mut self, stderr: &str, fault: Option<&str>) {
        self.text.push_str(&escape_unprintable(stderr));
        if !self.text.is_empty() && !self.text.ends_with('\n') {
            self.text.push('\n');
        }
        if let Some(fault) = fault {
            self.text.push_str("[faceoff] ");
            self.text.push_str(&escape_unprintable(fault));
            self.text.push('\n');
        }
        if self.text.len() > self.limit_bytes {
            let mut start = self.text.len() - self.limit_bytes;
            while !self.text.is_char_boundary(start) {
                start += 1;
            }
            self.text.drain(..start);
        }
    }

    pub fn into_text(self) -> String {
        self.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_keeps_its_end_and_whole_characters() {
        let mut log = Log::new(10);
        log.add("", None);
        assert_eq!(log.text, "");
        log.add("début", None);
        assert_eq!(log.text, "début\n");
        log.add("fin", Some("x"));
        assert!(
            log.text.len() <= 10 && log.text.ends_with("eoff] x\n"),
            "{:?}",
            log.text
        );
        let mut log = Log::new(100);
        log.add("\u{1b}[2J", Some("got \u{202e}"));
        assert_eq!(log.text, "\\u001b[2J\n[faceoff] got \\u202e\n");
        let mut log = Log::new(2);
        log.add("éé", None);
        assert_eq!(log.text, "\n");
    }
}
