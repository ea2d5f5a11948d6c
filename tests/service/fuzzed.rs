//! Tests the seeds of the fuzzers and their earlier findings.

#[path = "../../fuzz/src/lib.rs"]
mod promises;

use std::path::Path;

#[test]
fn bytes_that_were_interesting_once_break_no_promise() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    for (target, promise) in [
        ("case", promises::case as fn(&[u8])),
        ("profile", promises::profile),
        ("table", promises::table),
        ("batch", promises::batch),
    ] {
        let files = std::fs::read_dir(seeds.join(target)).expect("seeds");
        let mut tried = 0;
        for file in files {
            promise(&std::fs::read(file.expect("an entry").path()).expect("a seed"));
            tried += 1;
        }
        assert!(tried >= 2, "{target}");
    }
    for example in std::fs::read_dir(seeds.join("../../api/examples")).expect("examples") {
        let path = example.expect("an entry").path();
        promises::case(&std::fs::read(&path).expect("an example"));
    }
}
