//! The hashes of the *golden* episodes and games (fixed ones with known results) match those stored in `tests/golden/simulator.txt`.

use faceoff_sim::{AirHockeyProfile, golden};

const STORED_HASHES: &str = include_str!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../tests/golden/simulator.txt"
));

#[test]
fn golden_hashes_match_the_file() {
    let computed: String = golden::all().map(|golden| format!("{golden}\n")).collect();
    assert_eq!(computed, STORED_HASHES);
}

#[test]
fn golden_game_has_rallies_and_goals() {
    let (_, game) = golden::play_game(AirHockeyProfile::Ideal);
    println!("{:?}", game.referee());
    assert!(game.rally() >= 2 && game.referee().goals != [0; 2]);
}
