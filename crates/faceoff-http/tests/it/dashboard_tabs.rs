//! Tests of the tabs of the organiser dashboard, some of which have a second row.

use crate::{browser::Browser, html::texts, site::Site, team_dashboard::dashboard_page};
use serde_json::json;

#[tokio::test]
async fn tabs_of_people_and_site_have_a_second_row() {
    let site = Site::start().await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut grace = Browser::join(&site, "Grace", role).await;
    for (path, tab, pages, own) in [
        (
            "/organiser/teams",
            "People",
            vec!["Teams", "Users and tokens"],
            "Teams",
        ),
        (
            "/organiser/access",
            "People",
            vec!["Teams", "Users and tokens"],
            "Users and tokens",
        ),
        (
            "/organiser/workers",
            "Site",
            vec!["Workers", "Storage"],
            "Workers",
        ),
        (
            "/organiser/storage",
            "Site",
            vec!["Workers", "Storage"],
            "Storage",
        ),
    ] {
        let page = dashboard_page(&grace.open(path).await, 200);
        let first_row = ".tabs:not(.sub)";
        let current = texts(&page, &format!("{first_row} [aria-current=true]"));
        assert_eq!(current, [tab], "{path}");
        let tabs = texts(&page, &format!("{first_row} li"));
        assert!(!tabs.contains(&"Storage".to_owned()), "{tabs:?}");
        let second = format!(".tabs.sub[aria-label={tab}]");
        assert_eq!(texts(&page, &format!("{second} li")), pages, "{path}");
        let current = texts(&page, &format!("{second} [aria-current=page]"));
        assert_eq!(current, [own], "{path}");
    }
    let day = dashboard_page(&grace.open("/organiser/day").await, 200);
    assert_eq!(texts(&day, ".tabs [aria-current=page]"), ["Evaluation day"]);
    assert!(texts(&day, ".tabs.sub").is_empty());
}
