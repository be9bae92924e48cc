//! The part of Python's pickle, protocol 2, that a list of transitions needs. NumPy arrays are calls of
//! `numpy.array`, which serializers of plain data cannot express.

use std::io::{self, Write};

const PROTOCOL_2: &[u8] = b"\x80\x02";
const EMPTY_LIST: u8 = b']';
const MARK: u8 = b'(';
const APPENDS: u8 = b'e';
const APPEND: u8 = b'a';
const TUPLE: u8 = b't';
const TUPLE1: u8 = 0x85;
const REDUCE: u8 = b'R';
const BINFLOAT: u8 = b'G';
const NEWTRUE: u8 = 0x88;
const NEWFALSE: u8 = 0x89;
const STOP: u8 = b'.';
/// Puts `numpy.array` on the stack remembers it as number 0 for `RECALL_ARRAY`, and takes it off.
const GLOBAL_ARRAY: &[u8] = b"cnumpy\narray\nq\x000";
const RECALL_ARRAY: &[u8] = b"h\x00";

/// One step of an episode.
pub(super) struct Transition<'a> {
    pub state: &'a [f64],
    pub action: &'a [f64],
    /// Lengths of the action's nested arrays, outermost first.
    pub action_shape: &'a [usize],
    pub reward: f64,
    pub next_state: &'a [f64],
    pub absorbing: bool,
    pub last: bool,
}

/// A list of `(state, action, reward, next_state, absorbing, last)`, written step by step.
pub(super) struct Transitions<W: Write> {
    out: W,
}

impl<W: Write> Transitions<W> {
    pub fn new(mut out: W) -> io::Result<Self> {
        out.write_all(PROTOCOL_2)?;
        out.write_all(GLOBAL_ARRAY)?;
        out.write_all(&[EMPTY_LIST])?;
        Ok(Self { out })
    }

    pub fn push(&mut self, step: &Transition<'_>) -> io::Result<()> {
        self.out.write_all(&[MARK])?;
        self.array(step.state, &[step.state.len()])?;
        self.array(step.action, step.action_shape)?;
        self.float(step.reward)?;
        self.array(step.next_state, &[step.next_state.len()])?;
        self.flag(step.absorbing)?;
        self.flag(step.last)?;
        self.out.write_all(&[TUPLE, APPEND])
    }

    pub fn finish(mut self) -> io::Result<()> {
        self.out.write_all(&[STOP])?;
        self.out.flush()
    }

    fn array(&mut self, numbers: &[f64], shape: &[usize]) -> io::Result<()> {
        self.out.write_all(RECALL_ARRAY)?;
        self.nested(numbers, shape)?;
        self.out.write_all(&[TUPLE1, REDUCE])
    }

    fn nested(&mut self, numbers: &[f64], shape: &[usize]) -> io::Result<()> {
        let Some((length, inner)) = shape.split_first() else {
            return match numbers {
                [number] => self.float(*number),
                _ => Err(io::Error::other("an array's shape and length differ")),
            };
        };
        self.out.write_all(&[EMPTY_LIST, MARK])?;
        if *length > 0 {
            for part in numbers.chunks((numbers.len() / length).max(1)) {
                self.nested(part, inner)?;
            }
        }
        self.out.write_all(&[APPENDS])
    }

    fn float(&mut self, number: f64) -> io::Result<()> {
        self.out.write_all(&[BINFLOAT])?;
        self.out.write_all(&number.to_be_bytes())
    }

    fn flag(&mut self, flag: bool) -> io::Result<()> {
        self.out.write_all(&[if flag { NEWTRUE } else { NEWFALSE }])
    }
}
