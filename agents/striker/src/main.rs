//! Speaks the agent protocol over standard input and output.

fn main() -> anyhow::Result<()> {
    striker::protocol::serve(std::io::stdin().lock(), std::io::stdout().lock())
}
