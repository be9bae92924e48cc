//! Power cuts, and the same score from anyone's machine.

use crate::{CONFIG, Team, dataset, entry, scored_locally, without_times};
use faceoff_tests::{bundle, server::Server};

#[test]
fn an_evaluation_survives_kill_9_and_scores_as_the_local_evaluator_does() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let striker = bundle::reference("striker", scratch.path());

    let mut server = Server::start(&data_dir, CONFIG);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &striker);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = team.evaluate(&server, &submission);

    // Killed whenever the next part of the evaluation has been played.
    for episodes in [1, 4, 8] {
        let _ = server.poll(&evaluation, &team.token, |answer| {
            answer["progress"]["episodes_done"].as_u64() >= Some(episodes)
        });
        server.kill();
        server = Server::start(&data_dir, CONFIG);
    }
    let survived = team.finished(&server, &evaluation);
    assert_eq!(survived["state"], "finished", "{survived:#}");

    let mut dataset = dataset(&server, &evaluation, &team.token);
    let manifest = entry(&mut dataset, "manifest.json");

    // The dataset released the day's seed: from now on the result tells it too.
    let survived = team.finished(&server, &evaluation);
    assert_eq!(survived["result"]["seed"], manifest["seed"]);

    let local = scored_locally(&striker, &manifest, 4, &scratch.path().join("local"));
    assert_eq!(without_times(&survived["result"]), without_times(&local));
}
