/// Response extension: other sites may embed this page in a frame.
#[derive(Debug, Clone, Copy)]
pub struct Embeddable;
