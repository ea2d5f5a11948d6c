//! Tests headers and caching of the page at `/` and of its files.

use crate::server::Server;

/// Returns the paths of the scripts, styles and pictures that an HTML text refers to.
fn linked(text: &str) -> Vec<String> {
    let named = text
        .split(['"', '\''])
        .filter(|part| part.starts_with("/page/"));
    named.map(str::to_owned).collect()
}

#[tokio::test]
async fn page_and_its_files_have_a_strict_policy() {
    let server = Server::idle().await;
    let page = server.get("/").await.is(200);
    let script = linked(&page.text).pop().expect("a script");
    for answer in [&page, &server.get(&script).await] {
        let policy = answer.header("content-security-policy").expect("a policy");
        for part in [
            "default-src 'none'",
            "script-src 'self'",
            "style-src 'self'",
            "require-trusted-types-for 'script'",
            "frame-ancestors 'none'",
        ] {
            assert!(policy.contains(part), "{part} in {policy}");
        }
        assert!(!policy.contains("unsafe"), "{policy}");
        assert_eq!(answer.header("x-content-type-options"), Some("nosniff"));
    }
    let contract = server.get("/docs/").await;
    let policy = contract.header("content-security-policy");
    assert!(policy.is_some_and(|policy| policy.contains("default-src 'self'")));
}

#[tokio::test]
async fn files_of_the_page_may_be_kept_for_good_and_the_page_itself_not() {
    let server = Server::idle().await;
    let page = server.get("/").await;
    assert_eq!(page.header("cache-control"), Some("private, no-cache"));
    assert!(page.header("etag").is_some());
    let files = linked(&page.text);
    assert!(files.len() > 5, "{files:?}");
    for path in &files {
        let file = server.get(path).await;
        assert_eq!(file.status, 200, "{path}");
        let lifetime = file.header("cache-control").expect("a lifetime");
        assert!(lifetime.contains("immutable"), "{path}: {lifetime}");
    }
    // A page that was loaded before an update of the service still finds its files, but must revalidate them.
    let other = server
        .get("/page/0123456789abcdef/js/page.js")
        .await
        .is(200);
    assert_eq!(other.header("cache-control"), Some("no-cache"));
    for path in [
        "/page/-/none.js",
        "/page/-/../mod.rs",
        "/page/-/%2e%2e/mod.rs",
    ] {
        assert_eq!(server.get(path).await.status, 404, "{path}");
    }
}
