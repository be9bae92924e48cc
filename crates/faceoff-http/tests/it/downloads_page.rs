//! Tests of the page with files for developing agents.

use crate::site::{Answer, Site};
use faceoff_http::{Download, DownloadContent};
use reqwest::Method;
use scraper::Selector;
use std::fs;

#[tokio::test]
async fn downloads_are_listed_with_hashes_and_served() {
    let folder = tempfile::tempdir().unwrap();
    let wheel = folder.path().join("faceoff.whl");
    fs::write(&wheel, b"a package").unwrap();
    let download = |name: &str, about: &str, content| Download {
        name: name.to_owned(),
        about: about.to_owned(),
        content,
    };
    let gone = DownloadContent::File(folder.path().join("gone"));
    let robot = DownloadContent::Memory(b"<robot/>".as_slice().into());
    let offered = vec![
        download("robot.urdf", "The robot", robot),
        download("faceoff.whl", "A package", DownloadContent::File(wheel)),
        download("gone", "", gone),
    ];
    let source = "https://git.example.org/faceoff";
    let site = Site::start().await.with_downloads(offered, source).await;
    let page = site.get("/downloads", None).await;
    let html = page.html(200);
    let names: Vec<String> = html
        .select(&Selector::parse("tbody th").unwrap())
        .map(|name| name.text().collect())
        .collect();
    assert_eq!(names, ["robot.urdf", "faceoff.whl"], "one cannot be read");
    for (name, content) in [("robot.urdf", "<robot/>"), ("faceoff.whl", "a package")] {
        let hash = blake3::hash(content.as_bytes()).to_string();
        assert!(page.body.contains(&hash), "{name}");
        let path = format!("/downloads/{name}");
        let file = site.get(&path, None).await;
        assert_eq!((file.status.as_u16(), &file.body[..]), (200, content));
        let disposition = format!("attachment; filename=\"{name}\"");
        assert_eq!(file.header("content-disposition"), disposition);
        let request = site.request(Method::GET, &path, None);
        let request = request.header("if-none-match", file.header("etag"));
        let unchanged = Answer::read(request.send().await.unwrap()).await;
        assert_eq!(unchanged.status, 304);
    }
    assert!(page.body.contains(&format!("href=\"{source}\"")));
    let page_of_changed = async {
        fs::write(folder.path().join("faceoff.whl"), b"a newer package").unwrap();
        site.get("/downloads", None).await.body
    };
    let newer = blake3::hash(b"a newer package").to_string();
    assert!(page_of_changed.await.contains(&newer));
    let file = site.get("/downloads/faceoff.whl", None).await;
    assert_eq!(file.body, "a newer package");
    for unknown in ["gone", "..%2Fsecret", "faceoff.whl%00"] {
        let answer = site.get(&format!("/downloads/{unknown}"), None).await;
        assert_eq!(answer.status, 404, "{unknown}");
    }
}
