//! The log of an agent, as its team reads it: its standard error (its beginning and end, if it is long), with its faults.

use anstream::adapter::strip_str;
use faceoff_sandbox::BoundedLog;
use faceoff_types::escape_unprintable;
use std::borrow::Cow;

/// The standard error of an agent's successive processes: its beginning and its end, as a terminal shows them.
#[derive(Debug)]
pub(crate) struct Log {
    bounded: BoundedLog,
    is_at_line_start: bool,
}

impl Log {
    /// An empty log that keeps at most `max_bytes`.
    pub fn new(max_bytes: u64) -> Self {
        Self {
            bounded: BoundedLog::new(max_bytes),
            is_at_line_start: true,
        }
    }

    /// Adds the output of one process, and the fault that ended it, if any.
    pub fn add(&mut self, stderr: &str, fault: Option<&str>) {
        self.push(&escape_unprintable(&as_terminal(stderr)));
        if !self.is_at_line_start {
            self.push("\n");
        }
        if let Some(fault) = fault {
            self.push(&format!("[faceoff] {}\n", escape_unprintable(fault)));
        }
    }

    fn push(&mut self, text: &str) {
        self.bounded.push(text.as_bytes());
        if !text.is_empty() {
            self.is_at_line_start = text.ends_with('\n');
        }
    }

    pub fn into_text(self) -> String {
        self.bounded.text()
    }
}

/// The text as a terminal shows it: without colours and other escape sequences. Of a line that was overwritten, such as a progress bar,
/// only the last state remains.
fn as_terminal(text: &str) -> Cow<'_, str> {
    if !text.contains(['\u{1b}', '\r', '\u{8}']) {
        return Cow::Borrowed(text);
    }
    let lines = text.split_inclusive('\n').map(|line| {
        let (content, end) = match line.strip_suffix('\n') {
            Some(content) => (content, "\n"),
            None => (line, ""),
        };
        // Lines of Windows end in a carriage return, too.
        let mut states = content.trim_end_matches('\r').rsplit('\r');
        let mut shown = String::new();
        for character in states.next().unwrap_or_default().chars() {
            if character == '\u{8}' {
                shown.pop();
            } else {
                shown.push(character);
            }
        }
        strip_str(&shown).to_string() + end
    });
    Cow::Owned(lines.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_keeps_its_end_and_whole_characters() {
        let mut log = Log::new(400);
        log.add("", None);
        log.add("début", None);
        log.add("début\n", Some("got \u{202e}"));
        let start = "début\ndébut\n[faceoff] got \\u202e\n";
        log.add(&"é".repeat(1000), Some("x"));
        let text = log.into_text();
        assert!(
            text.starts_with(start) && text.ends_with("é\n[faceoff] x\n"),
            "{text}"
        );
        assert!(
            text.len() <= 400 && text.contains("are left out here"),
            "{text}"
        );
    }

    #[test]
    fn log_reads_as_on_a_terminal() {
        for (written, shown) in [
            ("\u{1b}[31mred\u{1b}[0m\n", "red\n"),
            ("10 %\r50 %\r100 %\ndone", "100 %\ndone"),
            ("100 %\r\nWindows\r\n", "100 %\nWindows\n"),
            ("abd\u{8}c\n", "abc\n"),
            ("\u{8}\u{8}a\n", "a\n"),
            ("\u{1b}]0;title\u{7}text", "text"),
            ("tab\there\n\n", "tab\there\n\n"),
        ] {
            assert_eq!(as_terminal(written), shown, "{written:?}");
        }
    }
}
