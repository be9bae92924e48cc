//! Server-sent events, as <https://html.spec.whatwg.org/multipage/server-sent-events.html> has them; of line ends only
//! `\n` and `\r\n`, which is what servers send.

use anyhow::{Result, bail};
use futures::{Stream, StreamExt, stream};
use std::collections::VecDeque;

/// No event of ours is nearly as long; a server that sends more is none of ours.
const LONGEST_EVENT_BYTES: usize = 1 << 20;

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ServerEvent {
    pub name: String,
    pub data: String,
    /// By which a stream can be resumed after it.
    pub id: Option<String>,
}

/// The events of a body that comes in pieces.
pub fn events<B: AsRef<[u8]>>(
    pieces: impl Stream<Item = Result<B>>,
) -> impl Stream<Item = Result<ServerEvent>> {
    let state = (Box::pin(pieces), Decoder::default());
    stream::unfold(state, |(mut pieces, mut decoder)| async move {
        loop {
            if let Some(event) = decoder.ready.pop_front() {
                return Some((Ok(event), (pieces, decoder)));
            }
            let fed = match pieces.next().await? {
                Ok(piece) => decoder.feed(piece.as_ref()),
                Err(error) => Err(error),
            };
            if let Err(error) = fed {
                return Some((Err(error), (pieces, decoder)));
            }
        }
    })
}

#[derive(Debug, Default)]
struct Decoder {
    /// Of the last line, what has come.
    line: Vec<u8>,
    event: ServerEvent,
    ready: VecDeque<ServerEvent>,
}

impl Decoder {
    fn feed(&mut self, piece: &[u8]) -> Result<()> {
        for part in piece.split_inclusive(|byte| *byte == b'\n') {
            self.line.extend_from_slice(part);
            if self.line.len() + self.event.data.len() > LONGEST_EVENT_BYTES {
                bail!("the server sends an event without end; is it another version of Faceoff?");
            }
            if self.line.pop_if(|byte| *byte == b'\n').is_some() {
                self.line.pop_if(|byte| *byte == b'\r');
                let line = std::mem::take(&mut self.line);
                self.take(&String::from_utf8_lossy(&line));
            }
        }
        Ok(())
    }

    fn take(&mut self, line: &str) {
        if line.is_empty() {
            let event = std::mem::take(&mut self.event);
            // One without data is none.
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
            // A comment that keeps the connection alive, or what is of no use here.
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
    fn events_are_the_same_wherever_the_pieces_are_cut() {
        let text = "event: happening\nid: 1.17\ndata: {\"a\":\ndata: \"ü\"}\n\n: still there\n\nevent:over\r\ndata:x\r\n\r\n\
                    event: unfinished\ndata: lost\n";
        let expected = [
            event("happening", "{\"a\":\n\"ü\"}", Some("1.17")),
            event("over", "x", None),
        ];
        assert_eq!(decoded(&[text.as_bytes()]), expected);
        for cut in 0..text.len() {
            let (one, other) = text.as_bytes().split_at(cut);
            assert_eq!(decoded(&[one, other]), expected, "cut at {cut}");
        }
    }

    #[test]
    fn an_event_without_end_is_refused() {
        let mut decoder = Decoder::default();
        let piece = vec![b'x'; 1 << 19];
        decoder.feed(&piece).unwrap();
        decoder.feed(&piece).unwrap();
        let error = decoder.feed(&piece).unwrap_err().to_string();
        assert!(error.contains("without end"), "{error}");
    }
}
