//! The files of the page, as they are in the program.

use std::sync::LazyLock;

/// A file of the page.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PageFile {
    /// Its path below the page, with `/`.
    pub path: &'static str,
    /// What it holds.
    pub body: &'static [u8],
}

macro_rules! files {
    ($($path:literal),* $(,)?) => {
        &[$(PageFile {
            path: $path,
            body: include_bytes!(concat!("web/", $path)),
        }),*]
    };
}

/// Every file of the page.
pub(crate) const FILES: &[PageFile] = files!(
    "icon.svg",
    "index.html",
    "js/adopt.js",
    "js/api.js",
    "js/compare.js",
    "js/compareview.js",
    "js/compose.js",
    "js/contactform.js",
    "js/curve.js",
    "js/curvedata.js",
    "js/curving.js",
    "js/damageview.js",
    "js/deleting.js",
    "js/document.js",
    "js/downloads.js",
    "js/drawing/axes.js",
    "js/drawing/gaps.js",
    "js/drawing/patch.js",
    "js/drawing/profiles.js",
    "js/drawing/wheelset.js",
    "js/drawing/worn.js",
    "js/editing.js",
    "js/en15302.js",
    "js/events.js",
    "js/field.js",
    "js/field/cells.js",
    "js/field/colours.js",
    "js/field/comb.js",
    "js/field/layout.js",
    "js/field/palette.js",
    "js/field/picture.js",
    "js/field/quantities.js",
    "js/field/raster.js",
    "js/field/sections.js",
    "js/field/stick.js",
    "js/fieldmap.js",
    "js/fields.js",
    "js/files.js",
    "js/forecast.js",
    "js/forecastdata.js",
    "js/forecastview.js",
    "js/form.js",
    "js/format.js",
    "js/historyform.js",
    "js/jobsview.js",
    "js/late.js",
    "js/licences.js",
    "js/line.js",
    "js/lineview.js",
    "js/loadsview.js",
    "js/marks.js",
    "js/npz.js",
    "js/page.js",
    "js/placing.js",
    "js/queue.js",
    "js/remarks.js",
    "js/result.js",
    "js/resultview.js",
    "js/routes.js",
    "js/run.js",
    "js/runview.js",
    "js/savedrawing.js",
    "js/shell.js",
    "js/shifting.js",
    "js/starts.js",
    "js/state.js",
    "js/store.js",
    "js/strips.js",
    "js/tables.js",
    "js/traffic.js",
    "js/typed.js",
    "js/wear.js",
    "js/wheelloads.js",
    "js/wheelsetdata.js",
    "js/wheelsetview.js",
    "js/words.js",
    "js/written.js",
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

/// The file at a path below the page.
#[must_use]
pub(crate) fn find(path: &str) -> Option<&'static PageFile> {
    FILES.iter().find(|file| file.path == path)
}

/// Digest of all files: it changes with any of them, so that addresses with it may be kept for good.
pub(crate) static DIGEST: LazyLock<String> = LazyLock::new(|| {
    let mut hasher = blake3::Hasher::new();
    for file in FILES {
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
    use std::path::Path;

    use super::*;

    #[test]
    fn every_file_of_the_page_is_in_the_program() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/http/page/web");
        let mut folders = vec![root.clone()];
        let mut there = BTreeSet::new();
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(&folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    let place = path.strip_prefix(&root).expect("below the folder");
                    there.insert(place.display().to_string().replace('\\', "/"));
                }
            }
        }
        let listed: BTreeSet<String> = FILES.iter().map(|file| file.path.to_owned()).collect();
        assert_eq!(listed, there);
        assert_eq!(listed.len(), FILES.len());
    }
}
