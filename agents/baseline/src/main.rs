//! Speaks the agent protocol over standard input and output.

use baseline::Baseline;
use striker::protocol;

fn main() -> anyhow::Result<()> {
    let name = [env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION")];
    let (input, output) = (std::io::stdin().lock(), std::io::stdout().lock());
    protocol::serve(name, Baseline::new, input, output)
}
