//! Streaming reader for a form with a single file (`multipart/form-data`, RFC 7578). The file is never kept in memory, and the
//! size of everything around it is bounded. axum's own reader, `multer` 3, is not used. It buffers all data that the
//! connection has ready before it returns the first byte.

use axum::{
    body::{Body, BodyDataStream, Bytes},
    http::{HeaderMap, header},
};
use faceoff_service::{
    problem::{Problem, ProblemKind},
    transfer_rate::MinTransferRate,
};
use futures::{StreamExt, stream};
use std::io;
use tokio::time::Instant;

/// Largest size of the head of the part, and of the data after the file. Browsers send about 200 bytes.
const MAX_ENVELOPE_BYTES: usize = 8 * 1024;
/// Limit of RFC 2046.
const MAX_BOUNDARY_LENGTH: usize = 70;

/// A file that is being received.
pub(crate) struct FormFile {
    /// File name of the sender; empty if no file was chosen.
    pub(crate) name: String,
    /// Size of the file, if the request has a content length.
    pub(crate) bytes: Option<u64>,
    pub(crate) body: Body,
}

impl FormFile {
    /// Reads up to the start of the file, within the grace period of `rate`.
    ///
    /// # Errors
    /// `UnsupportedMediaType` for another content type; `InvalidRequest` for a malformed form; `RequestTimeout`.
    pub(crate) async fn read(
        headers: &HeaderMap,
        body: Body,
        rate: MinTransferRate,
    ) -> Result<Self, Problem> {
        let boundary = boundary(headers).ok_or_else(|| {
            Problem::new(
                ProblemKind::UnsupportedMediaType,
                "expected the form of the page with content type multipart/form-data",
            )
        })?;
        let deadline = Instant::now() + rate.grace;
        let mut stream = body.into_data_stream();
        let mut head: Vec<u8> = Vec::new();
        let file_start = loop {
            if let Some(at) = find(&head, b"\r\n\r\n") {
                break at + 4;
            }
            if head.len() > MAX_ENVELOPE_BYTES {
                return Err(malformed_form(
                    "the head of the file is missing or too long",
                ));
            }
            match tokio::time::timeout_at(deadline, stream.next()).await {
                Ok(Some(Ok(chunk))) => head.extend_from_slice(&chunk),
                Ok(Some(Err(error))) => return Err(malformed_form(&error.to_string())),
                Ok(None) => return Err(malformed_form("it ends before the file starts")),
                Err(_) => {
                    return Err(Problem::new(
                        ProblemKind::RequestTimeout,
                        "the form was not received in time; nothing was stored, send it again over a faster connection",
                    ));
                }
            }
        };
        let buffer = head.split_off(file_start);
        let lines = String::from_utf8_lossy(&head);
        let Some(lines) = lines.strip_prefix(&format!("--{boundary}\r\n")) else {
            return Err(malformed_form("it does not start with its boundary"));
        };
        let name =
            file_name(lines).ok_or_else(|| malformed_form("its first field is not a file"))?;
        let delimiter = format!("\r\n--{boundary}");
        let content_length = headers
            .get(header::CONTENT_LENGTH)
            .and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
        // The delimiter, then “--” and the line break.
        let envelope = (file_start + delimiter.len() + 4) as u64;
        let reader = FileReader {
            stream,
            buffer,
            delimiter: delimiter.into_bytes(),
            state: ReadState::File,
        };
        Ok(Self {
            name,
            bytes: content_length.map(|bytes| bytes.saturating_sub(envelope)),
            body: Body::from_stream(stream::unfold(reader, FileReader::next)),
        })
    }
}

fn malformed_form(why: &str) -> Problem {
    Problem::new(
        ProblemKind::InvalidRequest,
        format!("malformed form: {why}; reload the page and send the form again"),
    )
}

fn boundary(headers: &HeaderMap) -> Option<String> {
    let value = headers.get(header::CONTENT_TYPE)?.to_str().ok()?;
    let (essence, parameters) = value.split_once(';')?;
    if !essence.trim().eq_ignore_ascii_case("multipart/form-data") {
        return None;
    }
    let boundary = parameters.split(';').find_map(|parameter| {
        let (name, value) = parameter.trim().split_once('=')?;
        name.eq_ignore_ascii_case("boundary")
            .then(|| value.trim_matches('"'))
    })?;
    let is_valid = (1..=MAX_BOUNDARY_LENGTH).contains(&boundary.len())
        && boundary.chars().all(|c| c.is_ascii_graphic() || c == ' ');
    is_valid.then(|| boundary.to_owned())
}

/// File name in the head of the part.
fn file_name(head: &str) -> Option<String> {
    let line = head.lines().find(|line| {
        line.get(..20)
            .is_some_and(|name| name.eq_ignore_ascii_case("content-disposition:"))
    })?;
    // Browsers encode quotation marks in the name as %22.
    let (_, name) = line.split_once("; filename=\"")?;
    let (name, _) = name.split_once('"')?;
    Some(name.to_owned())
}

fn find(bytes: &[u8], pattern: &[u8]) -> Option<usize> {
    let first = *pattern.first()?;
    let mut from = 0;
    while let Some(at) = bytes[from..].iter().position(|byte| *byte == first) {
        if bytes[from + at..].starts_with(pattern) {
            return Some(from + at);
        }
        from += at + 1;
    }
    None
}

#[derive(Clone, Copy)]
enum ReadState {
    File,
    /// After the delimiter that ends the file.
    Trailer,
    Done,
}

struct FileReader {
    stream: BodyDataStream,
    /// Received data that is not passed on yet: the delimiter may start in it.
    buffer: Vec<u8>,
    delimiter: Vec<u8>,
    state: ReadState,
}

impl FileReader {
    async fn next(mut self) -> Option<(io::Result<Bytes>, Self)> {
        loop {
            match self.state {
                ReadState::Done => return None,
                ReadState::Trailer => {
                    let read = self.read_trailer().await;
                    self.state = ReadState::Done;
                    return read.err().map(|error| (Err(error), self));
                }
                ReadState::File => {}
            }
            let ready = match find(&self.buffer, &self.delimiter) {
                Some(at) => {
                    self.state = ReadState::Trailer;
                    at
                }
                None => self.buffer.len().saturating_sub(self.delimiter.len() - 1),
            };
            if ready > 0 {
                let rest = self.buffer.split_off(ready);
                let ready_bytes = std::mem::replace(&mut self.buffer, rest);
                return Some((Ok(ready_bytes.into()), self));
            }
            if let ReadState::File = self.state {
                let error = match self.stream.next().await {
                    Some(Ok(chunk)) => {
                        self.buffer.extend_from_slice(&chunk);
                        continue;
                    }
                    Some(Err(error)) => io::Error::other(error),
                    None => io::Error::other("the form ends inside the file"),
                };
                self.state = ReadState::Done;
                return Some((Err(error), self));
            }
        }
    }

    /// Reads the data after the file, which must be the end of the form.
    async fn read_trailer(&mut self) -> io::Result<()> {
        while let Some(chunk) = self.stream.next().await {
            self.buffer
                .extend_from_slice(&chunk.map_err(io::Error::other)?);
            if self.buffer.len() > MAX_ENVELOPE_BYTES {
                return Err(io::Error::other("the form has more than one file"));
            }
        }
        match self.buffer[self.delimiter.len()..].starts_with(b"--") {
            true => Ok(()),
            false => Err(io::Error::other("the form has more than one file")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::{body, http::HeaderValue};
    use std::{convert::Infallible, time::Duration};

    const RATE: MinTransferRate = MinTransferRate {
        bytes_per_s: 1,
        grace: Duration::from_secs(600),
    };

    fn headers(bytes: Option<usize>) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(
            header::CONTENT_TYPE,
            HeaderValue::from_static("multipart/form-data; boundary=----abc"),
        );
        if let Some(bytes) = bytes {
            headers.insert(header::CONTENT_LENGTH, HeaderValue::from(bytes));
        }
        headers
    }

    fn form(file: &[u8], end: &str) -> Vec<u8> {
        let head = "------abc\r\nContent-Disposition: form-data; name=\"bundle\"; filename=\"a b.zip\"\r\n\
                    Content-Type: application/zip\r\n\r\n";
        [head.as_bytes(), file, end.as_bytes()].concat()
    }

    fn pieces(form: &[u8], size: usize) -> Body {
        let chunks: Vec<_> = form
            .chunks(size)
            .map(|chunk| Ok::<_, Infallible>(Bytes::copy_from_slice(chunk)))
            .collect();
        Body::from_stream(stream::iter(chunks))
    }

    const END: &str = "\r\n------abc--\r\n";

    #[tokio::test]
    async fn file_is_read_exactly_for_any_chunk_size() {
        // The file contains prefixes of the delimiter.
        let file = b"PK\r\n\r\n------ab\r\n------\r\n\r\n\r\r\n--";
        let form = form(file, END);
        for size in 1..=form.len() {
            let headers = headers(Some(form.len()));
            let read = FormFile::read(&headers, pieces(&form, size), RATE);
            let read = read.await.unwrap();
            assert_eq!(read.name, "a b.zip");
            assert_eq!(read.bytes, Some(file.len() as u64));
            let bytes = body::to_bytes(read.body, 1000).await.unwrap();
            assert_eq!(bytes.as_ref(), file, "in pieces of {size}");
        }
    }

    #[tokio::test]
    async fn malformed_forms_are_refused() {
        let truncated = form(b"PK", "");
        let two_files = form(b"PK", "\r\n------abc\r\nContent-Disposition: x\r\n\r\n");
        for form in [truncated, two_files] {
            let headers = headers(None);
            let read = FormFile::read(&headers, pieces(&form, 7), RATE);
            let read = read.await.unwrap();
            assert_eq!(read.bytes, None);
            assert!(body::to_bytes(read.body, 1000).await.is_err());
        }
        let endless = vec![b'x'; 3 * MAX_ENVELOPE_BYTES];
        for (form, expected) in [
            (endless.as_slice(), "missing or too long"),
            (b"------abc\r\n", "ends before"),
            (b"x\r\n\r\n", "does not start"),
            (
                b"------abc\r\nContent-Disposition: form-data; name=\"a\"\r\n\r\nb",
                "not a file",
            ),
        ] {
            let read = FormFile::read(&headers(None), pieces(form, 1000), RATE).await;
            let problem = read.err().unwrap();
            assert!(problem.detail().contains(expected), "{}", problem.detail());
        }
        let none = FormFile::read(&HeaderMap::new(), Body::empty(), RATE).await;
        let kind = none.err().unwrap().kind();
        assert_eq!(kind, ProblemKind::UnsupportedMediaType);
    }
}
