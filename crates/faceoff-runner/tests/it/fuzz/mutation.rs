use super::draws::Draws;
use std::ops::Range;

/// Changes `input` in one to six places: bits, bytes, ranges, words.
pub fn mutate(input: &mut Vec<u8>, words: &[&str], draws: &mut Draws) {
    for _ in 0..=draws.below(6) {
        once(input, words, draws);
    }
}

fn once(input: &mut Vec<u8>, words: &[&str], draws: &mut Draws) {
    let word = || words.iter().map(|word| word.as_bytes());
    match draws.below(11) {
        0 => {
            let at = draws.below(input.len());
            if let Some(byte) = input.get_mut(at) {
                *byte ^= 1 << draws.below(8);
            }
        }
        1 => {
            let at = draws.below(input.len());
            let value = *draws.pick(&[0, 0x7f, 0x80, 0xff, b'"', b'\\', b'{', b'[', b'\n']);
            if let Some(byte) = input.get_mut(at) {
                *byte = value;
            }
        }
        2 => {
            let range = range(input.len(), draws);
            input.drain(range);
        }
        3 => {
            let copy = input[range(input.len(), draws)].to_vec();
            let at = draws.below(input.len() + 1);
            input.splice(at..at, copy);
        }
        4 => {
            let at = draws.below(input.len() + 1);
            let word = word().nth(draws.below(words.len())).unwrap_or_default();
            input.splice(at..at, word.iter().copied());
        }
        5 | 6 => {
            let token = token(input, draws);
            let word = word().nth(draws.below(words.len())).unwrap_or_default();
            input.splice(token, word.iter().copied());
        }
        7 => {
            let token = token(input, draws);
            input.drain(token);
        }
        8 => {
            let token = token(input, draws);
            let copy = input[token.clone()].to_vec();
            let at = *draws.pick(&[token.start, token.end, 0, input.len()]);
            input.splice(at..at, copy);
        }
        9 => input.truncate(draws.below(input.len() + 1)),
        _ => {
            // Now and then very long.
            let len = if draws.once_in(8) { 70_000 } else { 40 };
            let at = draws.below(input.len() + 1);
            let byte = *draws.pick(b" 09[{a\"");
            input.splice(at..at, std::iter::repeat_n(byte, draws.below(len)));
        }
    }
}

fn range(len: usize, draws: &mut Draws) -> Range<usize> {
    let start = draws.below(len + 1);
    let longest = if draws.once_in(3) { len } else { 16 };
    start..(start + draws.below(longest + 1)).min(len)
}

/// A number, a word, or a sign between them.
fn token(input: &[u8], draws: &mut Draws) -> Range<usize> {
    let in_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"._-+".contains(byte);
    let at = draws.below(input.len());
    match input.get(at) {
        Some(byte) if in_word(byte) => {
            let start = input[..at].iter().rposition(|byte| !in_word(byte));
            let end = input[at..].iter().position(|byte| !in_word(byte));
            start.map_or(0, |start| start + 1)..end.map_or(input.len(), |end| at + end)
        }
        Some(_) => at..at + 1,
        None => 0..0,
    }
}
