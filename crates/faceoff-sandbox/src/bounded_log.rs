//! A log of bounded size: its beginning and its end.

use std::collections::VecDeque;

/// Share of the size for the beginning: what a program says at its start, and the first of many equal errors.
const BEGINNING_DIVISOR: usize = 4;
/// Size of the line that replaces what is left out.
const NOTE_BYTES: usize = 80;

/// The first and the last bytes of a log, without those between.
#[derive(Debug)]
pub struct BoundedLog {
    beginning: Vec<u8>,
    end: VecDeque<u8>,
    max_beginning_bytes: usize,
    max_end_bytes: usize,
    left_out_bytes: u64,
}

impl BoundedLog {
    /// An empty log of at most `max_bytes`, at least a few hundred.
    pub fn new(max_bytes: u64) -> Self {
        let max_bytes = usize::try_from(max_bytes).unwrap_or(usize::MAX);
        let max_beginning_bytes = max_bytes / BEGINNING_DIVISOR;
        let used_bytes = max_beginning_bytes.saturating_add(NOTE_BYTES);
        Self {
            beginning: Vec::new(),
            end: VecDeque::new(),
            max_beginning_bytes,
            max_end_bytes: max_bytes.saturating_sub(used_bytes),
            left_out_bytes: 0,
        }
    }

    /// Adds bytes at the end.
    pub fn push(&mut self, bytes: &[u8]) {
        let free_bytes = self.max_beginning_bytes - self.beginning.len();
        let (beginning, rest) = bytes.split_at(free_bytes.min(bytes.len()));
        self.beginning.extend_from_slice(beginning);
        // Do not store what would be left out at once.
        let (passed_by, kept) = rest.split_at(rest.len().saturating_sub(self.max_end_bytes));
        self.end.extend(kept);
        let excess = self.end.len().saturating_sub(self.max_end_bytes);
        self.end.drain(..excess);
        self.left_out_bytes += (passed_by.len() + excess) as u64;
    }

    /// The log as text, with a line in place of what is left out.
    pub fn text(&self) -> String {
        let end: Vec<u8> = self.end.iter().copied().collect();
        if self.left_out_bytes == 0 {
            let all = [self.beginning.as_slice(), &end].concat();
            return String::from_utf8_lossy(&all).into_owned();
        }
        // Characters that were cut are left out, too.
        let beginning = match std::str::from_utf8(&self.beginning) {
            Err(error) if error.error_len().is_none() => &self.beginning[..error.valid_up_to()],
            _ => &self.beginning,
        };
        let is_continuation = |byte: &u8| byte & 0b1100_0000 == 0b1000_0000;
        let cut_bytes = end
            .iter()
            .take(3)
            .take_while(|byte| is_continuation(byte))
            .count();
        format!(
            "{}\n[faceoff] {} bytes of this log are left out here\n{}",
            String::from_utf8_lossy(beginning),
            self.left_out_bytes,
            String::from_utf8_lossy(&end[cut_bytes..])
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_keeps_its_beginning_and_its_end() {
        let mut log = BoundedLog::new(480);
        assert_eq!(log.text(), "");
        log.push("début ".as_bytes());
        log.push(&[b'a'; 300]);
        assert_eq!(log.text(), format!("début {}", "a".repeat(300)));
        for _ in 0..100 {
            log.push(&[b'b'; 50]);
        }
        log.push("la fin".as_bytes());
        let text = log.text();
        assert!(
            text.starts_with("début aaa") && text.ends_with("bbbla fin"),
            "{text}"
        );
        let total = "début la fin".len() + 300 + 5000;
        let left_out = total - 120 - 280;
        let note = format!("\n[faceoff] {left_out} bytes of this log are left out here\n");
        assert!(text.contains(&note), "{text}");
        assert!(text.len() <= 480, "{}", text.len());
        log.push(&[b'c'; 100_000]);
        assert!(log.text().ends_with(&"c".repeat(280)));
    }

    #[test]
    fn cut_characters_are_left_out() {
        for shift in 0..4 {
            let mut log = BoundedLog::new(480);
            log.push(&vec![b'x'; shift]);
            log.push("€".repeat(1000).as_bytes());
            let text = log.text();
            assert!(!text.contains(char::REPLACEMENT_CHARACTER), "{text}");
            assert!(text.ends_with('€'));
        }
    }
}
