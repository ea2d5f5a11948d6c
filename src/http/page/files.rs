//! The files of the page, as they are in the program: those of `web`, and the examples of the API.

use std::sync::LazyLock;

/// A file of the page.
#[derive(Debug, Clone, Copy)]
pub struct PageFile {
    /// Its path below the page, with `/`.
    pub path: &'static str,
    /// What it holds.
    pub body: &'static [u8],
}

macro_rules! files {
    ($folder:literal, $prefix:literal: $($name:literal),* $(,)?) => {
        &[$(PageFile {
            path: concat!($prefix, $name),
            body: include_bytes!(concat!($folder, $name)),
        }),*]
    };
}

const WEB: &[PageFile] = files!("web/", "":
    "icon.svg",
    "index.html",
    "js/api.js",
    "js/compare.js",
    "js/compareview.js",
    "js/compose.js",
    "js/contactform.js",
    "js/curve.js",
    "js/curvedata.js",
    "js/document.js",
    "js/downloads.js",
    "js/drawing/axes.js",
    "js/drawing/gaps.js",
    "js/drawing/patch.js",
    "js/drawing/profiles.js",
    "js/editing.js",
    "js/events.js",
    "js/examples.js",
    "js/field.js",
    "js/field/cells.js",
    "js/field/colours.js",
    "js/field/layout.js",
    "js/field/palette.js",
    "js/field/picture.js",
    "js/field/quantities.js",
    "js/field/raster.js",
    "js/field/sections.js",
    "js/field/stick.js",
    "js/fieldmap.js",
    "js/fields.js",
    "js/form.js",
    "js/format.js",
    "js/jobsview.js",
    "js/late.js",
    "js/licences.js",
    "js/line.js",
    "js/lineview.js",
    "js/marks.js",
    "js/npz.js",
    "js/page.js",
    "js/placing.js",
    "js/queue.js",
    "js/result.js",
    "js/resultview.js",
    "js/routes.js",
    "js/shell.js",
    "js/state.js",
    "js/store.js",
    "js/strips.js",
    "js/tables.js",
    "page.css",
    "theme.css",
    "theme.js",
    "vendor/lit-html.LICENSE",
    "vendor/lit-html.js",
    "vendor/uPlot.LICENSE",
    "vendor/uPlot.esm.js",
    "vendor/uPlot.min.css",
    "vendor/vendor.json",
);

const EXAMPLES: &[PageFile] = files!("../../../api/examples/", "examples/":
    "area-132re-crown.case.json",
    "faulty.case.json",
    "hertz-steel.case.json",
    "paper-figure-3.case.json",
    "paper-figure-4.case.json",
    "paper-figure-5.case.json",
    "pressure-grid.case.json",
    "spin.case.json",
    "sweep.case.json",
    "two-patches.case.json",
    "uic60-crown.case.json",
    "wheel-rail-flange.case.json",
    "wheel-rail.case.json",
);

/// Every file of the page.
pub fn all() -> impl Iterator<Item = &'static PageFile> {
    WEB.iter().chain(EXAMPLES)
}

/// The file at a path below the page.
#[must_use]
pub fn find(path: &str) -> Option<&'static PageFile> {
    all().find(|file| file.path == path)
}

/// Digest of all files: it changes with any of them, so that addresses with it may be kept for good.
pub static DIGEST: LazyLock<String> = LazyLock::new(|| {
    let mut hasher = blake3::Hasher::new();
    for file in all() {
        hasher.update(file.path.as_bytes());
        hasher.update(&(file.body.len() as u64).to_le_bytes());
        hasher.update(file.body);
    }
    hasher.finalize().to_hex()[..16].to_owned()
});

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::{Path, PathBuf};

    use super::*;

    fn below(folder: &str, ending: &str) -> BTreeSet<String> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let mut folders = vec![root.clone()];
        let mut found = BTreeSet::new();
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(&folder).expect("a folder") {
                let path: PathBuf = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.display().to_string().ends_with(ending) {
                    let place = path.strip_prefix(&root).expect("below the folder");
                    found.insert(place.display().to_string().replace('\\', "/"));
                }
            }
        }
        found
    }

    fn listed(files: &[PageFile], prefix: &str) -> BTreeSet<String> {
        let paths = files.iter().map(|file| file.path);
        paths.map(|path| path.replacen(prefix, "", 1)).collect()
    }

    #[test]
    fn every_file_of_the_page_is_in_the_program() {
        assert_eq!(listed(WEB, ""), below("src/http/page/web", ""));
        let examples = below("api/examples", ".case.json");
        assert_eq!(listed(EXAMPLES, "examples/"), examples);
    }
}
