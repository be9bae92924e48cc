//! Drawings of the table on cards: the still pictures of the pages, in the same colours.

use super::style;
use crate::{
    replay_section::Still,
    table_drawing::{Dot, TableOutline},
};
use askama::Template;

/// Where a drawing is on a card: the left and upper end, and the width, px.
pub(super) struct Place {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) width: f64,
}

#[derive(Template)]
#[template(path = "card_still.svg")]
struct StillDrawing<'a> {
    place: Place,
    height: f64,
    css: &'static str,
    view_box: &'a str,
    /// `None`: the empty table.
    still: Option<&'a Still>,
    opponent: Option<Dot>,
    table: &'a TableOutline,
}

/// The SVG element of a still picture; `opponent` is the last position of the away side in a game.
pub(super) fn svg(still: &Still, opponent: Option<Dot>, place: Place) -> String {
    render(&StillDrawing {
        height: height(&still.table, &place),
        place,
        css: style::drawing_css(),
        view_box: &still.table.view_box,
        still: Some(still),
        opponent,
        table: &still.table,
    })
}

/// The SVG element of the empty table.
pub(super) fn empty_table(place: Place) -> String {
    let table = TableOutline::new();
    render(&StillDrawing {
        height: height(&table, &place),
        place,
        css: style::drawing_css(),
        view_box: &table.view_box,
        still: None,
        opponent: None,
        table: &table,
    })
}

/// The height of a drawing of this table.
fn height(table: &TableOutline, place: &Place) -> f64 {
    // `view_box` is “left top width height”.
    let mut sizes = table.view_box.split(' ').skip(2);
    let mut next_size = || sizes.next().and_then(|size| size.parse().ok());
    let (width, height): (Option<f64>, Option<f64>) = (next_size(), next_size());
    place.width
        * height
            .zip(width)
            .map_or(0.5, |(height, width)| height / width)
}

/// The drawing consists of numbers and of fixed texts, which can always be written.
fn render(drawing: &StillDrawing) -> String {
    drawing.render().unwrap_or_default()
}
