//! Property tests: actions and observations keep their bits, and no line of an agent makes the parser panic.

use faceoff_airhockey::Interpolation;
use faceoff_types::ACTION_LIMIT;
use faceoff_wire::{
    Message,
    answer::{parse_act, parse_ready, parse_reset_ready},
    quote_line,
};
use proptest::prelude::*;

/// Numbers of an action with the trajectory interpolation: 20 ms × (position, velocity, acceleration) × 7 joints.
const LONGEST_ACTION: usize = 20 * 3 * 7;

fn any_interpolation() -> impl Strategy<Value = Interpolation> {
    prop::sample::select(vec![
        Some(1),
        Some(2),
        Some(3),
        Some(4),
        Some(5),
        Some(-1),
        None,
    ])
    .prop_map(|code| Interpolation::from_code(code).expect("a code of the protocol"))
}

fn finite_number() -> impl Strategy<Value = f64> {
    any::<u64>()
        .prop_map(f64::from_bits)
        .prop_filter("finite", |value| value.is_finite())
}

/// Any number that an action may contain.
fn action_number() -> impl Strategy<Value = f64> {
    finite_number().prop_map(|value| {
        if value.abs() > ACTION_LIMIT {
            value % ACTION_LIMIT
        } else {
            value
        }
    })
}

/// The line of an action, as serde_json writes nested arrays.
fn act_line(step: u32, shape: &[usize], values: &[f64]) -> String {
    fn nest(shape: &[usize], values: &mut std::slice::Iter<'_, f64>) -> serde_json::Value {
        match shape.split_first() {
            None => (*values.next().expect("enough values")).into(),
            Some((len, inner)) => (0..*len).map(|_| nest(inner, values)).collect(),
        }
    }
    let action = nest(shape, &mut values.iter());
    serde_json::json!({"type": "act", "step": step, "action": action}).to_string()
}

proptest! {
    #[test]
    fn actions_round_trip_bit_for_bit(
        interpolation in any_interpolation(),
        step in any::<u32>(),
        numbers in prop::collection::vec(action_number(), LONGEST_ACTION),
    ) {
        let values = &numbers[..interpolation.len()];
        let mut action = Vec::new();
        let line = act_line(step, interpolation.shape(), values);
        parse_act(line.as_bytes(), step, interpolation.into(), &mut action).unwrap();
        prop_assert_eq!(
            action.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
            values.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        );
    }

    #[test]
    fn observations_round_trip_bit_for_bit(
        step in any::<u32>(), obs in prop::collection::vec(finite_number(), 0..24)
    ) {
        let mut line = Vec::new();
        Message::step(step, &obs).write_line(&mut line);
        prop_assert_eq!(line.iter().filter(|byte| **byte == b'\n').count(), 1);
        let read: serde_json::Value = serde_json::from_slice(&line).unwrap();
        prop_assert_eq!(&read["type"], "step");
        prop_assert_eq!(&read["step"], step);
        let obs_read: Vec<f64> = serde_json::from_value(read["obs"].clone()).unwrap();
        prop_assert_eq!(
            obs_read.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
            obs.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        );
    }

    #[test]
    fn arbitrary_bytes_do_not_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..300), interpolation in any_interpolation()
    ) {
        let mut action = Vec::new();
        prop_assert!(parse_act(&bytes, 0, interpolation.into(), &mut action).is_err());
        let _ = parse_ready(&bytes, &faceoff_airhockey::competition().actions);
        let _ = parse_reset_ready(&bytes, 0);
        prop_assert!(quote_line(&bytes).chars().count() <= 400);
    }

    /// A valid line with one part removed or overwritten either parses to a complete, finite action or is refused.
    #[test]
    fn damaged_lines_give_a_complete_action_or_a_fault(
        interpolation in any_interpolation(),
        numbers in prop::collection::vec(-10.0..10.0f64, LONGEST_ACTION),
        damage_start in any::<prop::sample::Index>(),
        damage_bytes in 0..20usize,
        replacement in "[\\[\\]{}\",:0-9eE.NaInfity\\\\ -]{0,8}",
    ) {
        const STEP: u32 = 5;
        let mut line = act_line(STEP, interpolation.shape(), &numbers[..interpolation.len()]);
        let start = damage_start.index(line.len());
        let end = (start + damage_bytes).min(line.len());
        line.replace_range(start..end, &replacement);
        let mut action = Vec::new();
        if parse_act(line.as_bytes(), STEP, interpolation.into(), &mut action).is_ok() {
            prop_assert_eq!(action.len(), interpolation.len());
            prop_assert!(action.iter().all(|value| value.abs() <= ACTION_LIMIT));
        }
    }
}
