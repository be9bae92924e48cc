//! A server that is killed during an evaluation and restarted: its result equals that of the local evaluator.

use crate::{CONFIG, Team, dataset, entry, score_locally, without_times};
use faceoff_tests::{bundle, server::Server};

#[test]
fn killed_server_scores_evaluation_like_local_evaluator() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let striker = bundle::example_agent("striker", scratch.path());

    let mut server = Server::start(&data_dir, CONFIG);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &striker);
    assert_eq!(submission["state"], "valid", "{submission:#}");
    let evaluation = team.evaluate(&server, &submission);

    // The server is killed after so many of the 12 episodes of the evaluation, and restarted.
    for episodes in [1, 4, 8] {
        let _ = server.poll(&evaluation, &server.admin_token, |answer| {
            answer["progress"]["episodes_done"].as_u64() >= Some(episodes)
        });
        server.kill();
        server = Server::start(&data_dir, CONFIG);
    }
    let survived = team.wait_until_finished(&server, &evaluation);
    assert_eq!(survived["state"], "finished", "{survived:#}");

    let mut dataset = dataset(&server, &evaluation, &team.token);
    let manifest = entry(&mut dataset, "manifest.json");

    // The dataset has the day's seed. Its download shows that the day is released, so the result contains the seed, too.
    let survived = team.wait_until_finished(&server, &evaluation);
    assert_eq!(survived["result"]["seed"], manifest["seed"]);

    let local = score_locally(&striker, &manifest, 4, &scratch.path().join("local"));
    assert_eq!(without_times(&survived["result"]), without_times(&local));
}
