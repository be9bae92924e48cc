//! Random mutations of valid input.

use super::rng::Rng;
use std::ops::Range;

/// Mutates `input` in one to six positions: bits, bytes, ranges, words.
pub fn mutate(input: &mut Vec<u8>, words: &[&str], rng: &mut Rng) {
    for _ in 0..=rng.below(6) {
        mutate_once(input, words, rng);
    }
}

fn mutate_once(input: &mut Vec<u8>, words: &[&str], rng: &mut Rng) {
    let word = || words.iter().map(|word| word.as_bytes());
    match rng.below(11) {
        0 => {
            let position = rng.below(input.len());
            if let Some(byte) = input.get_mut(position) {
                *byte ^= 1 << rng.below(8);
            }
        }
        1 => {
            let position = rng.below(input.len());
            let value = *rng.pick(&[0, 0x7f, 0x80, 0xff, b'"', b'\\', b'{', b'[', b'\n']);
            if let Some(byte) = input.get_mut(position) {
                *byte = value;
            }
        }
        2 => {
            let range = random_range(input.len(), rng);
            input.drain(range);
        }
        3 => {
            let copy = input[random_range(input.len(), rng)].to_vec();
            let position = rng.below(input.len() + 1);
            input.splice(position..position, copy);
        }
        4 => {
            let position = rng.below(input.len() + 1);
            let word = word().nth(rng.below(words.len())).unwrap_or_default();
            input.splice(position..position, word.iter().copied());
        }
        5 | 6 => {
            let token = random_token(input, rng);
            let word = word().nth(rng.below(words.len())).unwrap_or_default();
            input.splice(token, word.iter().copied());
        }
        7 => {
            let token = random_token(input, rng);
            input.drain(token);
        }
        8 => {
            let token = random_token(input, rng);
            let copy = input[token.clone()].to_vec();
            let position = *rng.pick(&[token.start, token.end, 0, input.len()]);
            input.splice(position..position, copy);
        }
        9 => input.truncate(rng.below(input.len() + 1)),
        _ => {
            // Occasionally very long.
            let len = if rng.once_in(8) { 70_000 } else { 40 };
            let position = rng.below(input.len() + 1);
            let byte = *rng.pick(b" 09[{a\"");
            input.splice(
                position..position,
                std::iter::repeat_n(byte, rng.below(len)),
            );
        }
    }
}

/// A random range, mostly short.
fn random_range(len: usize, rng: &mut Rng) -> Range<usize> {
    let start = rng.below(len + 1);
    let longest = if rng.once_in(3) { len } else { 16 };
    start..(start + rng.below(longest + 1)).min(len)
}

/// The position of a random token: a number, a word, or a sign between them.
fn random_token(input: &[u8], rng: &mut Rng) -> Range<usize> {
    let in_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"._-+".contains(byte);
    let position = rng.below(input.len());
    match input.get(position) {
        Some(byte) if in_word(byte) => {
            let start = input[..position].iter().rposition(|byte| !in_word(byte));
            let end = input[position..].iter().position(|byte| !in_word(byte));
            start.map_or(0, |start| start + 1)..end.map_or(input.len(), |end| position + end)
        }
        Some(_) => position..position + 1,
        None => 0..0,
    }
}
