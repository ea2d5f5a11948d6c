//! The page at `/`: its headers, how long its files are kept, and that vendored files are those of their packages.

use std::fs;
use std::path::Path;

use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::server::Server;

const WEB: &str = "src/http/page/web";

/// The paths of the scripts, styles and pictures that a text of HTML names.
fn linked(text: &str) -> Vec<String> {
    let named = text
        .split(['"', '\''])
        .filter(|part| part.starts_with("/page/"));
    named.map(str::to_owned).collect()
}

#[tokio::test]
async fn page_and_its_files_have_a_strict_policy() {
    let server = Server::idle().await;
    let page = server.get("/").await;
    assert_eq!(page.status, 200);
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
    // A page that was loaded before the service was renewed finds its files still, but must ask again.
    let other = server.get("/page/0123456789abcdef/js/page.js").await;
    assert_eq!(other.status, 200, "{}", other.text);
    assert_eq!(other.header("cache-control"), Some("no-cache"));
    for path in [
        "/page/-/none.js",
        "/page/-/../mod.rs",
        "/page/-/%2e%2e/mod.rs",
    ] {
        assert_eq!(server.get(path).await.status, 404, "{path}");
    }
}

#[tokio::test]
async fn page_names_no_other_server() {
    let server = Server::idle().await;
    let page = server.get("/").await;
    assert!(!page.text.contains("//"), "{}", page.text);
}

#[test]
fn vendored_files_are_those_of_their_packages() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join(WEB)
        .join("vendor");
    let text = fs::read_to_string(folder.join("vendor.json")).expect("the list");
    let list: Value = serde_json::from_str(&text).expect("JSON");
    let mut listed = vec!["vendor.json".to_owned()];
    for package in list.as_array().expect("packages") {
        for file in package["files"].as_array().expect("files") {
            let name = file["file"].as_str().expect("a name");
            let body = fs::read(folder.join(name)).expect("a vendored file");
            let digest = Sha256::digest(&body);
            let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
            assert_eq!(file["sha256"], digest, "{name}");
            listed.push(name.to_owned());
        }
        let licence = package["licence"].as_str().expect("a licence");
        assert!(["BSD-3-Clause", "MIT"].contains(&licence), "{licence}");
    }
    let entries = fs::read_dir(&folder).expect("the folder");
    let mut there: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    listed.sort();
    there.sort();
    assert_eq!(there, listed);
}
