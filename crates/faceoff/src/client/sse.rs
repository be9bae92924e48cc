//! Decoder of server-sent events, <https://html.spec.whatwg.org/multipage/server-sent-events.html>. It accepts `\n` and
//! `\r\n` as line ends, but not a lone `\r`.

use anyhow::{Result, bail};
use futures::{Stream, StreamExt, stream};
use std::collections::VecDeque;

/// Far longer than any event of a Faceoff server.
const LONGEST_EVENT_BYTES: usize = 1 << 20;

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ServerEvent {
    pub name: String,
    pub data: String,
    /// Resumes the stream after this event, as `Last-Event-ID`.
    pub id: Option<String>,
}

/// Decodes a response body that arrives in pieces.
pub fn events<B: AsRef<[u8]>>(
    pieces: impl Stream<Item = Result<B>>,
) -> impl Stream<Item = Result<ServerEvent>> {
    let state = (Box::pin(pieces), Decoder::default());
    stream::unfold(state, |(mut pieces, mut decoder)| async move {
        loop {
            if let Some(event) = decoder.ready.pop_front() {
                return Some((Ok(event), (pieces, decoder)));
            }
            let result = match pieces.next().await? {
                Ok(piece) => decoder.feed(piece.as_ref()),
                Err(error) => Err(error),
            };
            if let Err(error) = result {
                return Some((Err(error), (pieces, decoder)));
            }
        }
    })
}

/// A decoder of pieces that may end within a line.
#[derive(Debug, Default)]
struct Decoder {
    /// The received beginning of the current line.
    line: Vec<u8>,
    /// The lines of the current event, which an empty line completes.
    event: ServerEvent,
    /// Complete events that have not been returned yet.
    ready: VecDeque<ServerEvent>,
}

impl Decoder {
    fn feed(&mut self, piece: &[u8]) -> Result<()> {
        for part in piece.split_inclusive(|byte| *byte == b'\n') {
            self.line.extend_from_slice(part);
            if self.line.len() + self.event.data.len() > LONGEST_EVENT_BYTES {
                bail!(
                    "the server sent an event of more than 1 MiB; is it another version of Faceoff?"
                );
            }
            if self.line.pop_if(|byte| *byte == b'\n').is_some() {
                self.line.pop_if(|byte| *byte == b'\r');
                let line = std::mem::take(&mut self.line);
                self.process_line(&String::from_utf8_lossy(&line));
            }
        }
        Ok(())
    }

    fn process_line(&mut self, line: &str) {
        if line.is_empty() {
            let event = std::mem::take(&mut self.event);
            // The standard drops events without data.
            if !event.data.is_empty() {
                self.ready.push_back(event);
            }
            return;
        }
        let (field, value) = line.split_once(':').unwrap_or((line, ""));
        let value = value.strip_prefix(' ').unwrap_or(value);
        match field {
            "event" => value.clone_into(&mut self.event.name),
            "id" => self.event.id = Some(value.to_owned()),
            "data" => {
                if !self.event.data.is_empty() {
                    self.event.data.push('\n');
                }
                self.event.data.push_str(value);
            }
            // Comments keep the connection alive; other fields are not needed.
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(pieces: &[&[u8]]) -> Vec<ServerEvent> {
        let mut decoder = Decoder::default();
        for piece in pieces {
            decoder.feed(piece).unwrap();
        }
        decoder.ready.into()
    }

    fn event(name: &str, data: &str, id: Option<&str>) -> ServerEvent {
        ServerEvent {
            name: name.to_owned(),
            data: data.to_owned(),
            id: id.map(str::to_owned),
        }
    }

    #[test]
    fn events_do_not_depend_on_the_piece_boundaries() {
        let text = "event: happening\nid: 1.17\ndata: {\"a\":\ndata: \"ü\"}\n\n: still there\n\nevent:over\r\ndata:x\r\n\r\n\
                    event: unfinished\ndata: lost\n";
        let expected = [
            event("happening", "{\"a\":\n\"ü\"}", Some("1.17")),
            event("over", "x", None),
        ];
        assert_eq!(decoded(&[text.as_bytes()]), expected);
        for split_at in 0..text.len() {
            let (one, other) = text.as_bytes().split_at(split_at);
            assert_eq!(decoded(&[one, other]), expected, "split at {split_at}");
        }
    }

    #[test]
    fn endless_event_is_refused() {
        let mut decoder = Decoder::default();
        let piece = vec![b'x'; 1 << 19];
        decoder.feed(&piece).unwrap();
        decoder.feed(&piece).unwrap();
        let error = decoder.feed(&piece).unwrap_err().to_string();
        assert!(error.contains("more than 1 MiB"), "{error}");
    }
}
