//! Compresses gzip members (each a complete gzip stream, here one clip) with a reused compressor, since creating one takes longer than
//! compressing a clip.

use flate2::{Compression, Crc, write::DeflateEncoder};
use std::io::{self, Write};

/// Creates gzip members. The same bytes give the same member.
#[derive(Debug)]
pub(crate) struct Gzip {
    deflate: DeflateEncoder<Vec<u8>>,
}

/// Header of a member: deflate, without name, time and comment, from an unknown system (RFC 1952).
const HEADER: [u8; 10] = [0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 0xff];

impl Default for Gzip {
    fn default() -> Self {
        // The fastest level: clips are compressed while agents play, and the differences between numbers, of which clips
        // consist, gain little from higher levels.
        Self {
            deflate: DeflateEncoder::new(Vec::new(), Compression::fast()),
        }
    }
}

impl Gzip {
    /// Compresses the parts into one member.
    ///
    /// # Errors
    /// If writing to memory fails.
    pub fn member(&mut self, parts: &[&[u8]]) -> io::Result<Vec<u8>> {
        let mut crc = Crc::new();
        let length: usize = parts.iter().map(|part| part.len()).sum();
        let mut out = Vec::with_capacity(length / 2 + 64);
        out.extend_from_slice(&HEADER);
        // The previous member is complete and was taken out.
        self.deflate.reset(out)?;
        for part in parts {
            crc.update(part);
            self.deflate.write_all(part)?;
        }
        let mut member = self.deflate.reset(Vec::new())?;
        member.extend_from_slice(&crc.sum().to_le_bytes());
        member.extend_from_slice(&crc.amount().to_le_bytes());
        Ok(member)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::read::GzDecoder;
    use std::io::Read;

    #[test]
    fn gzip_members_are_complete_and_reproducible() {
        let mut gzip = Gzip::default();
        let long = [7, 1, 4].repeat(5000);
        let parts: [&[&[u8]]; 3] = [&[b"one", b" and two"], &[], &[&long, b"end"]];
        let first = parts.map(|parts| gzip.member(parts).unwrap());
        for (parts, member) in parts.iter().zip(&first) {
            let mut read = Vec::new();
            let mut decoder = GzDecoder::new(member.as_slice());
            decoder.read_to_end(&mut read).unwrap();
            assert_eq!(read, parts.concat());
            assert_eq!(&gzip.member(parts).unwrap(), member);
        }
    }
}
