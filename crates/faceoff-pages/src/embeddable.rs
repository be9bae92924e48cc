//! A mark on responses that other sites may embed.

/// Response extension: other sites may embed this page in a frame. Without it the server forbids that with a header.
#[derive(Debug, Clone, Copy)]
pub struct Embeddable;
