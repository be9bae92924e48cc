use std::io::{self, Read};

/// A file that has as many bytes as it had when its header was written, or fails: an archive whose header says another
/// number is broken from there on.
pub(super) struct Whole<R> {
    file: io::Take<R>,
}

impl<R: Read> Whole<R> {
    pub(super) fn of(file: R, bytes: u64) -> Self {
        Self {
            file: file.take(bytes),
        }
    }
}

impl<R: Read> Read for Whole<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read(buffer)?;
        if read == 0 && self.file.limit() > 0 && !buffer.is_empty() {
            return Err(io::Error::other(
                "it became shorter while it was packed; is something still writing it?",
            ));
        }
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_changes_is_cut_or_refused() {
        let read = |bytes| {
            let mut found = Vec::new();
            Whole::of(&b"abc"[..], bytes)
                .read_to_end(&mut found)
                .map(|_| found)
        };
        assert_eq!(read(3).unwrap(), b"abc");
        assert_eq!(read(2).unwrap(), b"ab");
        assert!(read(4).unwrap_err().to_string().contains("became shorter"));
    }
}
