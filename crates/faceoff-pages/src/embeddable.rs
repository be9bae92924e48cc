//! Marks on responses for which the server sends other security headers than for pages.

/// Response extension: other sites may embed this page in a frame, or show this picture. Without it the server forbids that with headers.
#[derive(Debug, Clone, Copy)]
pub struct Embeddable;

/// Response extension: an SVG picture with its own styles. It may load nothing.
#[derive(Debug, Clone, Copy)]
pub struct StyledPicture;
