//! Fuzz test of agents' answers (lines of JSON): each is valid, or an agent fault with a printable message.

use super::{assert_outcomes, fuzz, mutation::mutate};
use faceoff_airhockey::simulator;
use faceoff_sim::Interpolation;
use faceoff_types::{ACTION_LIMIT, AgentFaultKind, escape_unprintable};
use faceoff_wire::{
    MAX_LINE_BYTES,
    answer::{parse_act, parse_ready, parse_reset_ready},
    quote_line,
};
use serde_json::Value;

/// Texts that mutations insert.
const WORDS: [&str; 24] = [
    "NaN",
    "-Infinity",
    "1e999",
    "1.7e308",
    "-10001",
    "1e4",
    "5e-324",
    "-0",
    "7",
    "null",
    "true",
    "\"\"",
    "{}",
    "[]",
    "{\"a\":1,\"a\":2}",
    "\"x\":{\"y\":[]},",
    "\"step\":7,",
    "\"type\":\"act\",",
    "ready",
    "act",
    "\\u0061",
    "\\ud800",
    "\u{202e}",
    "\u{1b}[2J",
];

/// A valid answer to step 7.
fn act(interpolation: Interpolation) -> String {
    fn nest(shape: &[usize], numbers: &mut impl Iterator<Item = String>) -> String {
        match shape.split_first() {
            None => numbers.next().unwrap(),
            Some((len, inner)) => {
                let parts: Vec<_> = (0..*len).map(|_| nest(inner, numbers)).collect();
                format!("[{}]", parts.join(","))
            }
        }
    }
    let mut numbers = (0..interpolation.len()).map(|i| format!("{}", i as f64 / 16.0 - 3.0));
    let action = nest(interpolation.shape(), &mut numbers);
    format!(
        "{{\"type\":\"act\",\"step\":7,\"action\":{action},\"note\":{{\"a\":[1,{{\"b\":2}}]}}}}"
    )
}

/// The kind of a fault, whose message must be printable.
fn label(fault: &AgentFaultKind) -> String {
    let message = fault.to_string();
    assert_eq!(escape_unprintable(&message), message);
    assert!(message.chars().count() < 1000, "{message}");
    let name = format!("{fault:?}");
    name.split([' ', '{']).next().unwrap().to_owned()
}

#[test]
fn answers_are_valid_or_an_agent_fault() {
    let codes: Vec<_> = [1, 2, 3, 4, 5, -1]
        .map(Some)
        .into_iter()
        .chain([None])
        .map(|code| Interpolation::from_code(code).unwrap())
        .collect();
    let outcomes = fuzz("answers", 60_000, |rng| {
        let interpolation = *rng.pick(&codes);
        let kind = rng.below(6);
        let mut line = match kind {
            0 => br#"{"type":"ready","protocol":1,"interpolation":3,"name":"a","version":"1"}"#
                .to_vec(),
            1 => br#"{"type":"ready","episode":7}"#.to_vec(),
            _ => act(interpolation).into_bytes(),
        };
        mutate(&mut line, &WORDS, rng);
        assert!(quote_line(&line).chars().count() <= 400);
        let outcome = match kind {
            0 => parse_ready(&line, &simulator().competition().actions).map(drop),
            1 => parse_reset_ready(&line, 7),
            _ => {
                let mut action = Vec::new();
                let parsed = parse_act(&line, 7, interpolation.into(), &mut action);
                if parsed.is_ok() {
                    assert_eq!(action.len(), interpolation.len());
                    assert!(action.iter().all(|number| number.abs() <= ACTION_LIMIT));
                }
                parsed
            }
        };
        match outcome {
            Ok(()) => {
                assert!(line.len() <= MAX_LINE_BYTES);
                // Another JSON reader must agree on the type, unless a number overflows.
                if let Ok(value) = serde_json::from_slice::<Value>(&line) {
                    assert_eq!(value["type"], if kind < 2 { "ready" } else { "act" });
                }
                "accepted".to_owned()
            }
            Err(fault) => label(&fault),
        }
    });
    assert_outcomes(
        &outcomes,
        &[
            "accepted",
            "NotJson",
            "WrongMessage",
            "WrongShape",
            "NonFinite",
            "TooLarge",
            "LineTooLong",
        ],
    );
}
