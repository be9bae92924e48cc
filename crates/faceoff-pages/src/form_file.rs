//! The file of a form as a browser sends it (`multipart/form-data`, RFC 7578): the form's only part, streamed. Nothing of
//! the file is kept in memory, and what surrounds it is bounded. (The reader that comes with axum, `multer` 3, takes in all
//! that the connection has ready before it hands on the first byte.)

use axum::{
    body::{Body, BodyDataStream, Bytes},
    http::{HeaderMap, header},
};
use faceoff_service::{
    pace::LeastRate,
    problem::{Problem, ProblemKind},
};
use futures::{StreamExt, stream};
use std::io;
use tokio::time::Instant;

/// The part's own head, and what follows the file, are shorter than this; those of browsers have some 200 bytes.
const AROUND_BYTES: usize = 8 * 1024;
/// By RFC 2046.
const LONGEST_BOUNDARY: usize = 70;

/// A file on its way.
pub(crate) struct FormFile {
    /// As its sender calls it; empty if none was chosen.
    pub(crate) name: String,
    /// How many bytes it has, where the form's were announced.
    pub(crate) bytes: Option<u64>,
    pub(crate) body: Body,
}

impl FormFile {
    /// Reads as far as the file begins, within the grace of `rate`.
    ///
    /// # Errors
    /// `UnsupportedMediaType` if it is no such form; `InvalidRequest` if it is a broken one; `RequestTimeout`.
    pub(crate) async fn of(
        headers: &HeaderMap,
        body: Body,
        rate: LeastRate,
    ) -> Result<Self, Problem> {
        let boundary = boundary(headers).ok_or_else(|| {
            Problem::new(
                ProblemKind::UnsupportedMediaType,
                "expected the form of the page, of the type multipart/form-data",
            )
        })?;
        let until = Instant::now() + rate.grace;
        let mut stream = body.into_data_stream();
        let mut head: Vec<u8> = Vec::new();
        let begins = loop {
            if let Some(at) = find(&head, b"\r\n\r\n") {
                break at + 4;
            }
            if head.len() > AROUND_BYTES {
                return Err(broken("its file has no head"));
            }
            match tokio::time::timeout_at(until, stream.next()).await {
                Ok(Some(Ok(chunk))) => head.extend_from_slice(&chunk),
                Ok(Some(Err(error))) => return Err(broken(&error.to_string())),
                Ok(None) => return Err(broken("it ends before its file begins")),
                Err(_) => {
                    return Err(Problem::new(
                        ProblemKind::RequestTimeout,
                        "the form did not come; nothing was stored, send it again over a faster connection",
                    ));
                }
            }
        };
        let held = head.split_off(begins);
        let lines = String::from_utf8_lossy(&head);
        let Some(lines) = lines.strip_prefix(&format!("--{boundary}\r\n")) else {
            return Err(broken("it does not begin with its boundary"));
        };
        let name = file_name(lines).ok_or_else(|| broken("its first field is no file"))?;
        let delimiter = format!("\r\n--{boundary}");
        let announced = headers
            .get(header::CONTENT_LENGTH)
            .and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
        // The delimiter, and “--” with the line's end behind it.
        let around = (begins + delimiter.len() + 4) as u64;
        let rest = Rest {
            stream,
            held,
            delimiter: delimiter.into_bytes(),
            at: At::File,
        };
        Ok(Self {
            name,
            bytes: announced.map(|bytes| bytes.saturating_sub(around)),
            body: Body::from_stream(stream::unfold(rest, Rest::next)),
        })
    }
}

fn broken(why: &str) -> Problem {
    Problem::new(
        ProblemKind::InvalidRequest,
        format!("the form is not understood: {why}; load the page anew, and send it again"),
    )
}

fn boundary(headers: &HeaderMap) -> Option<String> {
    let value = headers.get(header::CONTENT_TYPE)?.to_str().ok()?;
    let (essence, parameters) = value.split_once(';')?;
    if !essence.trim().eq_ignore_ascii_case("multipart/form-data") {
        return None;
    }
    let boundary = parameters.split(';').find_map(|one| {
        let (name, value) = one.trim().split_once('=')?;
        name.eq_ignore_ascii_case("boundary")
            .then(|| value.trim_matches('"'))
    })?;
    let is_fine = (1..=LONGEST_BOUNDARY).contains(&boundary.len())
        && boundary.chars().all(|c| c.is_ascii_graphic() || c == ' ');
    is_fine.then(|| boundary.to_owned())
}

/// The name that the part's head gives its file.
fn file_name(head: &str) -> Option<String> {
    let line = head.lines().find(|line| {
        line.get(..20)
            .is_some_and(|name| name.eq_ignore_ascii_case("content-disposition:"))
    })?;
    // Browsers write a quotation mark in it as %22.
    let (_, name) = line.split_once("; filename=\"")?;
    let (name, _) = name.split_once('"')?;
    Some(name.to_owned())
}

fn find(bytes: &[u8], sought: &[u8]) -> Option<usize> {
    let first = *sought.first()?;
    let mut from = 0;
    while let Some(at) = bytes[from..].iter().position(|byte| *byte == first) {
        if bytes[from + at..].starts_with(sought) {
            return Some(from + at);
        }
        from += at + 1;
    }
    None
}

/// Where the reading of a form is.
#[derive(Clone, Copy)]
enum At {
    File,
    /// Behind the file, whose end was told.
    Behind,
    Over,
}

struct Rest {
    stream: BodyDataStream,
    /// Read, and not handed on: the delimiter may begin in it.
    held: Vec<u8>,
    delimiter: Vec<u8>,
    at: At,
}

impl Rest {
    async fn next(mut self) -> Option<(io::Result<Bytes>, Self)> {
        loop {
            match self.at {
                At::Over => return None,
                At::Behind => {
                    let read = self.behind().await;
                    self.at = At::Over;
                    return read.err().map(|error| (Err(error), self));
                }
                At::File => {}
            }
            let ready = match find(&self.held, &self.delimiter) {
                Some(at) => {
                    self.at = At::Behind;
                    at
                }
                None => self.held.len().saturating_sub(self.delimiter.len() - 1),
            };
            if ready > 0 {
                let later = self.held.split_off(ready);
                let now = std::mem::replace(&mut self.held, later);
                return Some((Ok(now.into()), self));
            }
            if let At::File = self.at {
                let read = match self.stream.next().await {
                    Some(Ok(chunk)) => {
                        self.held.extend_from_slice(&chunk);
                        continue;
                    }
                    Some(Err(error)) => io::Error::other(error),
                    None => io::Error::other("the form ends within its file"),
                };
                self.at = At::Over;
                return Some((Err(read), self));
            }
        }
    }

    /// Reads what follows the file, which is nothing but the form's end.
    async fn behind(&mut self) -> io::Result<()> {
        while let Some(chunk) = self.stream.next().await {
            self.held
                .extend_from_slice(&chunk.map_err(io::Error::other)?);
            if self.held.len() > AROUND_BYTES {
                return Err(io::Error::other("the form has more than one file"));
            }
        }
        match self.held[self.delimiter.len()..].starts_with(b"--") {
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

    const RATE: LeastRate = LeastRate {
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
    async fn the_file_comes_as_it_was_however_the_form_is_cut() {
        // Among them what looks like the delimiter's beginning.
        let file = b"PK\r\n\r\n------ab\r\n------\r\n\r\n\r\r\n--";
        let form = form(file, END);
        for size in 1..=form.len() {
            let headers = headers(Some(form.len()));
            let read = FormFile::of(&headers, pieces(&form, size), RATE);
            let read = read.await.unwrap();
            assert_eq!(read.name, "a b.zip");
            assert_eq!(read.bytes, Some(file.len() as u64));
            let bytes = body::to_bytes(read.body, 1000).await.unwrap();
            assert_eq!(bytes.as_ref(), file, "in pieces of {size}");
        }
    }

    #[tokio::test]
    async fn what_is_no_such_form_is_told() {
        let cut = form(b"PK", "");
        let two = form(b"PK", "\r\n------abc\r\nContent-Disposition: x\r\n\r\n");
        for form in [cut, two] {
            let headers = headers(None);
            let read = FormFile::of(&headers, pieces(&form, 7), RATE);
            let read = read.await.unwrap();
            assert_eq!(read.bytes, None);
            assert!(body::to_bytes(read.body, 1000).await.is_err());
        }
        let endless = vec![b'x'; 3 * AROUND_BYTES];
        for (form, words) in [
            (endless.as_slice(), "has no head"),
            (b"------abc\r\n", "ends before"),
            (b"x\r\n\r\n", "does not begin"),
            (
                b"------abc\r\nContent-Disposition: form-data; name=\"a\"\r\n\r\nb",
                "no file",
            ),
        ] {
            let read = FormFile::of(&headers(None), pieces(form, 1000), RATE).await;
            let problem = read.err().unwrap();
            assert!(problem.detail().contains(words), "{}", problem.detail());
        }
        let none = FormFile::of(&HeaderMap::new(), Body::empty(), RATE).await;
        let kind = none.err().unwrap().kind();
        assert_eq!(kind, ProblemKind::UnsupportedMediaType);
    }
}
