use anyhow::Context;

/// The lines, or what stands in their place.
pub(super) fn or_none(lines: Vec<String>, none: &str) -> String {
    if lines.is_empty() {
        none.to_owned()
    } else {
        lines.join("\n")
    }
}

/// Prints what the server answered: as it came, or as text.
pub(super) fn print<T: serde::Serialize>(
    json: bool,
    value: &T,
    text: impl FnOnce() -> String,
) -> anyhow::Result<()> {
    if json {
        println!(
            "{}",
            serde_json::to_string_pretty(value).context("writing JSON")?
        );
    } else {
        println!("{}", text());
    }
    Ok(())
}
