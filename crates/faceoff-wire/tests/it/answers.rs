//! Valid and invalid lines of an agent. Unless a test says otherwise, the line answers step 4 and the interpolation is cubic, so that
//! an action has 2 rows of 7 numbers.

use faceoff_airhockey::Interpolation;
use faceoff_types::{ActionLayout, ActionSpace, AgentFaultKind};
use faceoff_wire::{
    MAX_LINE_BYTES,
    answer::{parse_act, parse_ready, parse_reset_ready},
};

/// The control step that the lines answer.
const STEP: u32 = 4;
const STEP_TEXT: &str = "4";

/// One number for each of the 7 joints.
fn actions() -> ActionSpace {
    faceoff_airhockey::competition().actions
}

fn row(value: &str) -> String {
    format!("[{}]", [value; 7].join(","))
}

fn act(step: &str, action: &str) -> String {
    format!("{{\"type\":\"act\",\"step\":{step},\"action\":{action}}}")
}

fn valid_act() -> String {
    act(STEP_TEXT, &format!("[{},{}]", row("0.5"), row("-0")))
}

fn parse(line: &str) -> Result<Vec<f64>, AgentFaultKind> {
    let mut action = vec![9.0; 3]; // content that parsing must replace
    parse_act(
        line.as_bytes(),
        STEP,
        Interpolation::Cubic.into(),
        &mut action,
    )
    .map(|()| action)
}

#[track_caller]
fn assert_wrong_message(line: &str, expected_got: &str) {
    match parse(line) {
        Err(AgentFaultKind::WrongMessage { got, .. }) => assert_eq!(got, expected_got),
        other => panic!("{line}: {other:?}"),
    }
}

#[track_caller]
fn assert_wrong_shape(action: &str, expected_got: &str) {
    match parse(&act(STEP_TEXT, action)) {
        Err(AgentFaultKind::WrongShape { expected, got }) => {
            assert_eq!((expected.as_str(), got.as_str()), ("[2][7]", expected_got));
        }
        other => panic!("{action}: {other:?}"),
    }
}

#[track_caller]
fn assert_not_json(line: &str, expected_words: &str) {
    match parse(line) {
        Err(AgentFaultKind::NotJson { detail }) => {
            assert!(
                detail.contains(expected_words),
                "{detail:?} lacks {expected_words:?}"
            );
        }
        other => panic!("{line}: {other:?}"),
    }
}

#[test]
fn action_is_read_row_major_with_its_bits() {
    let action = parse(&valid_act()).unwrap();
    assert_eq!(action.len(), 14);
    assert_eq!(action[..7], [0.5; 7]);
    assert!(
        action[7..]
            .iter()
            .all(|v| *v == 0.0 && v.is_sign_negative())
    );
}

#[test]
fn field_order_spaces_and_extra_fields_do_not_matter() {
    let line = format!(
        " {{ \"note\" : {{\"deep\":[[[1e999,\"NaN\"]]]}}, \"action\":[{},{}],\"x\":1,\"y\":2,\
         \"step\":4,\"type\":\"a\\u0063t\"}} \r",
        row("1"),
        row("2e0"),
    );
    assert_eq!(parse(&line).unwrap()[6..8], [1.0, 2.0]);
}

#[test]
fn notations_of_other_languages_are_read() {
    for step in ["4.0", "4e0", "40e-1"] {
        let line = valid_act().replace(":4,", &format!(":{step},"));
        assert!(parse(&line).is_ok(), "{line}");
    }
    assert!(parse(&format!("\u{feff}{}", valid_act())).is_ok());
    let ready = r#"{"type":"ready","protocol":1.0,"interpolation":3.0}"#;
    let interpolation = parse_ready(ready.as_bytes(), &actions()).unwrap().layout;
    assert_eq!(interpolation.code(), Some(3));
}

#[test]
fn all_action_shapes_are_read() {
    let nest = |n: usize, inner: &str| format!("[{}]", vec![inner; n].join(","));
    for (code, text) in [
        (Some(1), row("1")),
        (Some(2), row("1")),
        (Some(3), nest(2, &row("1"))),
        (Some(4), nest(2, &row("1"))),
        (Some(5), nest(3, &row("1"))),
        (Some(-1), nest(2, &row("1"))),
        (None, nest(20, &nest(3, &row("1")))),
    ] {
        let interpolation = Interpolation::from_code(code).unwrap();
        let mut action = Vec::new();
        parse_act(
            act("0", &text).as_bytes(),
            0,
            interpolation.into(),
            &mut action,
        )
        .unwrap();
        assert_eq!(action.len(), interpolation.len(), "{interpolation}");
    }
}

#[test]
fn wrong_message_or_step_is_named() {
    assert_wrong_message(&valid_act().replace("act", "ready"), "ready");
    assert_wrong_message(
        &valid_act().replace("\"act\"", "7"),
        "an object whose type is 7",
    );
    assert_wrong_message(
        &valid_act().replace("\"type\"", "\"kind\""),
        "an object without type",
    );
    assert_wrong_message(&valid_act().replace(":4,", ":3,"), "act with step 3");
    assert_wrong_message(&valid_act().replace(":4,", ":4.5,"), "act with step 4.5");
    assert_wrong_message(
        &valid_act().replace(":4,", ":4e300,"),
        "act with step 4e300",
    );
    assert_wrong_message(&valid_act().replace(":4,", ":-1,"), "act with step -1");
    assert_wrong_message(
        &valid_act().replace(":4,", ":[[4]],"),
        "act with step an array",
    );
    assert_wrong_message(
        &valid_act().replace("\"step\"", "\"Step\""),
        "act without step",
    );
    assert_wrong_message("{\"type\":\"act\",\"step\":4}", "act without action");
}

#[test]
fn wrong_shape_is_named() {
    assert_wrong_shape(&row("1"), "[7]");
    assert_wrong_shape(&format!("[{}]", row("1")), "[1][7]");
    let flat = format!("[{}]", ["1"; 14].join(","));
    assert_wrong_shape(&flat, "[14] (one flat list; send a list per row)");
    let transposed = format!("[{}]", ["[1,2]"; 7].join(","));
    assert_wrong_shape(&transposed, "[7][2] (transposed; send a list per row)");
    assert_wrong_shape(
        &format!("[[{0},{0}]]", row("1")),
        "[1][2][7] (a batch of one; send its only element)",
    );
    assert_wrong_shape(
        &format!("[{0},{0}]", row("0,5")),
        "[2][14] (perhaps with decimal commas; JSON has decimal points)",
    );
    assert_wrong_shape(&format!("[{0},{0},{0}]", row("1")), "[3][7]");
    assert_wrong_shape("[[1,2],[3,4]]", "[2][2]");
    assert_wrong_shape("[]", "[0]");
    assert_wrong_shape("3", "a number");
    assert_wrong_shape("null", "null");
    assert_wrong_shape(
        &format!("[{},[1,2]]", row("1")),
        "2 numbers or rows at action[1]",
    );
    assert_wrong_shape(
        &format!("[{},{}]", row("1"), row("\"1\"")),
        "a string at action[1][0]",
    );
    assert_wrong_shape(
        &format!("[{},{}]", row("1"), row("[1]")),
        "an array at action[1][0]",
    );
    assert_wrong_shape(
        &format!("[{},{}]", row("null"), row("1")),
        "null at action[0][0]",
    );
}

#[test]
fn non_finite_numbers_are_refused_in_any_notation() {
    for word in [
        "NaN",
        "-Infinity",
        "Infinity",
        "1e999",
        "-1e400",
        "1e99999999999999999999",
    ] {
        let line = act(STEP_TEXT, &format!("[{},{}]", row("0.1"), row(word)));
        assert_eq!(parse(&line), Err(AgentFaultKind::NonFinite), "{word}");
    }
    assert_eq!(
        parse(&act(STEP_TEXT, "NaN")),
        Err(AgentFaultKind::NonFinite)
    );
    let long_number = "9".repeat(5000);
    assert_eq!(
        parse(&act(
            STEP_TEXT,
            &format!("[{},{}]", row("0"), row(&long_number))
        )),
        Err(AgentFaultKind::NonFinite)
    );
}

#[test]
fn too_large_number_is_refused_with_its_place() {
    let assert_too_large = |text: &str, expected_value: f64| {
        let mut second_row = ["0.5"; 7];
        second_row[3] = text;
        let action = format!("[{},[{}]]", row("-1"), second_row.join(","));
        assert_eq!(
            parse(&act(STEP_TEXT, &action)),
            Err(AgentFaultKind::TooLarge {
                place: "action[1][3]".to_owned(),
                value: expected_value,
                limit: 1e4,
            }),
            "{text}"
        );
    };
    for text in [
        "1.7e308",
        "-1.7e308",
        "1e5",
        "10000.000001",
        "-10001",
        "123456789012345678901234567890",
    ] {
        assert_too_large(text, text.parse().unwrap());
    }
    let trajectory_interpolation = Interpolation::from_code(None).unwrap();
    let millisecond = format!("[{0},{0},{0}]", row("0"));
    let last_millisecond = format!("[{0},{0},{1}]", row("0"), row("2e4"));
    let trajectory = [vec![&*millisecond; 19], vec![&*last_millisecond]]
        .concat()
        .join(",");
    let line = act(STEP_TEXT, &format!("[{trajectory}]"));
    let fault = parse_act(
        line.as_bytes(),
        STEP,
        trajectory_interpolation.into(),
        &mut Vec::new(),
    )
    .unwrap_err();
    assert_eq!(
        fault.to_string(),
        "action[19][2][0] is 20000.0: expected numbers between -10000 and 10000 (rad, rad/s, rad/s²)"
    );
    // Accepted: numbers at the bound, a denormal, one that rounds to 0, and one with more digits than a double holds.
    let many_digits = format!("0.{}1", "0".repeat(4000));
    for (text, value) in [
        ("10000", 1e4),
        ("-1e4", -1e4),
        ("5e-324", 5e-324),
        ("1e-999", 0.0),
        (&*many_digits, 0.0),
    ] {
        let line = act(STEP_TEXT, &format!("[{},{}]", row("0"), row(text)));
        assert_eq!(parse(&line).unwrap()[13], value, "{text}");
    }
}

#[test]
fn invalid_json_is_refused_with_a_reason() {
    assert_not_json("", "the line is empty");
    assert_not_json("   ", "the line is empty");
    assert_not_json("hello", "at character 1 (standard output is for answers");
    assert_not_json("{'type': 'act'}", "(this looks like a printed Python dict");
    let with_none = "{\"type\": \"act\", \"note\": None}";
    assert_not_json(with_none, "(this looks like a printed Python dict");
    assert_not_json(
        "{\"type\": \"act\", \"action\": [array([1.0])]}",
        "(this looks like a printed array",
    );
    assert_not_json("{type: \"act\"}", "(names need double quotes in JSON)");
    assert_not_json("[1,2]", "expected an object");
    assert_not_json("null", "expected an object");
    assert_not_json("\"act\"", "expected an object");
    assert_not_json(&valid_act()[..30], "EOF");
    assert_not_json(
        &format!("{}{}", valid_act(), valid_act()),
        "trailing characters",
    );
    assert_not_json("{'type':'act'}", "key must be a string");
    assert_not_json("{\"type\":NaNsense}", "at character 9");
    assert_not_json("loss: NaN", "at character 1");
    let long = format!("\"{}\"", "é".repeat(20_000));
    assert_not_json(&long, "… at character 40002");
    // The text itself contains " at ", by which the position at the end of the parser's message is found.
    let with_at_near_end = format!("\"{} at {}\"", "é".repeat(300), "é".repeat(300));
    for line in [long.clone(), format!("\n{long}"), with_at_near_end] {
        let Err(AgentFaultKind::NotJson { detail }) = parse(&line) else {
            panic!("expected NotJson");
        };
        assert!(detail.chars().count() < 400, "{detail}");
    }
    let mut action = Vec::new();
    let fault = parse_act(
        b"{\"type\":\"\xff\"}",
        0,
        Interpolation::Cubic.into(),
        &mut action,
    )
    .unwrap_err();
    assert_eq!(
        fault,
        AgentFaultKind::NotJson {
            detail: "not UTF-8 after byte 9".into()
        }
    );
}

#[test]
fn repeated_key_is_refused() {
    for key in ["type", "step", "action"] {
        let line = valid_act().replacen(
            '{',
            &format!(
                "{{\"{key}\":{},",
                match key {
                    "type" => "\"act\"".to_owned(),
                    "step" => "4".to_owned(),
                    _ => format!("[{},{}]", row("1"), row("1")),
                }
            ),
            1,
        );
        assert_not_json(&line, &format!("the key \"{key}\" is given twice"));
    }
}

#[test]
fn repeated_key_is_refused_at_any_depth() {
    for (extra, key) in [
        (r#""x":1,"x":2"#, "x"),
        (r#""x":1,"y":{"a":[]},"x":{}"#, "x"),
        (r#""x":{"b":1,"a":{"b":2},"b":3}"#, "b"),
        (r#""x":[[0,[{"":1,"":1}]]]"#, ""),
        (r#""x":{"a":1,"\u0061":1}"#, "a"),
        (r#""x":{"\"}{":1,"\"}{":1}"#, "\"}{"),
        (r#""x":{"type":"act","type":"act"}"#, "type"),
        (r#""name":{"a":0,"a":0}"#, "a"),
        (r#""version":[{"a":0,"a":0}]"#, "a"),
    ] {
        let line = valid_act().replacen('{', &format!("{{{extra},"), 1);
        assert_not_json(&line, &format!("the key {key:?} is given twice"));
        let ready = format!(r#"{{"type":"ready","protocol":1,"interpolation":3,{extra}}}"#);
        let fault = parse_ready(ready.as_bytes(), &actions());
        assert!(
            matches!(fault, Err(AgentFaultKind::NotJson { .. })),
            "{ready}"
        );
    }
    assert_not_json(
        &valid_act().replacen('{', r#"{"x":{"\ud800":1},"#, 1),
        "a key cannot be read",
    );
    // An action in a `ready` is skipped like an unknown field, but checked for repeated keys.
    let ready = r#"{"type":"ready","episode":1,"action":[{"a":1,"a":2}]}"#;
    assert!(matches!(
        parse_reset_ready(ready.as_bytes(), 1),
        Err(AgentFaultKind::NotJson { .. })
    ));
    // The same text in another object, or as a value, is no repetition.
    for extra in [
        r#""x":{"a":1},"y":{"a":1}"#,
        r#""x":["a","a","a"]"#,
        r#""x":{"a":"a","b":"a"}"#,
        r#""x":[{"a":1},{"a":1}]"#,
        r#""x":{"a\\":1,"a":"\"a\":1,"}"#,
    ] {
        let line = valid_act().replacen('{', &format!("{{{extra},"), 1);
        assert!(parse(&line).is_ok(), "{line}");
    }
}

#[test]
fn line_limit_is_64_kib() {
    let pad = MAX_LINE_BYTES - valid_act().len();
    assert!(parse(&format!("{}{}", valid_act(), " ".repeat(pad))).is_ok());
    assert_eq!(
        parse(&format!("{}{}", valid_act(), " ".repeat(pad + 1))),
        Err(AgentFaultKind::LineTooLong {
            limit_bytes: 65_536
        })
    );
}

#[test]
fn deep_nesting_does_not_exhaust_the_stack() {
    let nesting_bytes = MAX_LINE_BYTES - 200; // leaves space for the rest of the line
    for opening in ["[", "{\"a\":"] {
        let nested = opening.repeat(nesting_bytes / opening.len());
        for field in ["x", "type", "step", "action", "name"] {
            let line = format!("{{\"{field}\":{nested}");
            assert!(parse(&line).is_err(), "{field}");
            assert!(parse_ready(line.as_bytes(), &actions()).is_err(), "{field}");
        }
    }
    let closed = format!(
        "{}{}",
        "[".repeat(nesting_bytes / 2),
        "]".repeat(nesting_bytes / 2)
    );
    assert!(matches!(
        parse(&act(STEP_TEXT, &closed)),
        Err(AgentFaultKind::WrongShape { .. })
    ));
    let with_unknown_field = valid_act().replacen('{', &format!("{{\"x\":{closed},"), 1);
    assert!(with_unknown_field.len() <= MAX_LINE_BYTES);
    assert!(parse(&with_unknown_field).is_ok());
}

#[test]
fn ready_to_hello_is_parsed_and_checked() {
    let parse = |text: &str| parse_ready(text.as_bytes(), &actions());
    let full = r#"{"type":"ready","protocol":1,"interpolation":3,"name":"x","version":"2"}"#;
    let parsed = parse(full).unwrap();
    assert_eq!(parsed.layout, Interpolation::Cubic.into());
    assert_eq!(
        (parsed.name.as_deref(), parsed.version.as_deref()),
        (Some("x"), Some("2"))
    );
    let with_null =
        parse(r#"{"type":"ready","protocol":1,"interpolation":null,"name":7}"#).unwrap();
    assert_eq!((with_null.layout.code(), with_null.name), (None, None));

    for (line, expected_got) in [
        (full.replace("ready", "act"), "act"),
        (full.replace(":1,", ":2,"), "ready with protocol 2"),
        (
            full.replace("\"protocol\":1,", ""),
            "ready without protocol",
        ),
        (
            full.replace("\"interpolation\":3,", ""),
            "ready without interpolation",
        ),
        (full.replace(":3,", ":7,"), "ready with interpolation 7"),
        (
            full.replace(":3,", ":\"3\","),
            "ready with interpolation \"3\"",
        ),
    ] {
        match parse(&line) {
            Err(AgentFaultKind::WrongMessage { got, .. }) => assert_eq!(got, expected_got),
            other => panic!("{line}: {other:?}"),
        }
    }
}

#[test]
fn ready_to_reset_must_name_the_episode() {
    assert_eq!(
        parse_reset_ready(br#"{"type":"ready","episode":17}"#, 17),
        Ok(())
    );
    let got = |line: &str| match parse_reset_ready(line.as_bytes(), 17) {
        Err(AgentFaultKind::WrongMessage { expected, got }) => {
            assert_eq!(expected, "ready with episode 17");
            got
        }
        other => panic!("{line}: {other:?}"),
    };
    assert_eq!(
        got(r#"{"type":"ready","episode":16}"#),
        "ready with episode 16"
    );
    assert_eq!(got(r#"{"type":"ready"}"#), "ready without episode");
    assert_eq!(got(&valid_act()), "act");
}

#[test]
fn only_layout_need_not_be_stated() {
    let single = ActionSpace {
        agents_choose_layout: false,
        layouts: vec![ActionLayout::new(None, &[2])],
    };
    let ready = parse_ready(br#"{"type":"ready","protocol":1}"#, &single).unwrap();
    assert_eq!(ready.layout.shape(), [2]);
    let mut action = Vec::new();
    parse_act(act("0", "[1,-1]").as_bytes(), 0, ready.layout, &mut action).unwrap();
    assert_eq!(action, [1.0, -1.0]);
    let other_type = parse_ready(br#"{"type":"act","protocol":1}"#, &single).unwrap_err();
    let text = other_type.to_string();
    assert!(
        text.contains("ready with protocol 1") && !text.contains("interpolation"),
        "{text}"
    );
}
