//! Reading of a file whose size the archive's header has already stated.

use std::io::{self, Read};

/// A reader that delivers exactly the number of bytes that the archive's header promises, or fails. With another
/// number, the rest of the archive would be unreadable.
pub(super) struct SizedReader<R> {
    file: io::Take<R>,
}

impl<R: Read> SizedReader<R> {
    pub(super) fn new(file: R, bytes: u64) -> Self {
        Self {
            file: file.take(bytes),
        }
    }
}

impl<R: Read> Read for SizedReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read(buffer)?;
        if read == 0 && self.file.limit() > 0 && !buffer.is_empty() {
            return Err(io::Error::other(
                "it became shorter while it was packed; is another program still writing it?",
            ));
        }
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longer_file_is_truncated_and_shorter_one_refused() {
        let read = |bytes| {
            let mut content = Vec::new();
            SizedReader::new(&b"abc"[..], bytes)
                .read_to_end(&mut content)
                .map(|_| content)
        };
        assert_eq!(read(3).unwrap(), b"abc");
        assert_eq!(read(2).unwrap(), b"ab");
        assert!(read(4).unwrap_err().to_string().contains("became shorter"));
    }
}
