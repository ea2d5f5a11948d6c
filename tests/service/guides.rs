//! Runs the code blocks of the guides unchanged against the real program.

use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

use crate::schemathesis::said_by;
use crate::support::{Service, skip};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Returns the concatenated blocks of a language in a guide, with the address of the service under test.
fn blocks(guide: &str, language: &str, service: &Service) -> String {
    let text = std::fs::read_to_string(Path::new(ROOT).join(guide)).expect("a guide");
    let fences = format!("```{language}\n");
    let blocks = text.split(&fences).skip(1);
    let blocks = blocks.map(|rest| rest.split("```").next().expect("a block"));
    let blocks: String = blocks.collect();
    assert!(
        blocks.lines().count() > 3,
        "{guide} has no blocks of {language}"
    );
    let address = service.address().to_string();
    blocks.replace("localhost:8080", &address)
}

/// Creates a temporary folder with a link to `api`, so that `api/examples` is found as in the repository.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::os::unix::fs::symlink(Path::new(ROOT).join("api"), folder.path().join("api"))
        .expect("a link");
    folder
}

/// Runs a program in a folder. Returns its output, and panics if it fails.
fn run(program: &Path, arguments: &[&str], folder: &Path) -> String {
    let mut command = Command::new(program);
    let command = command.args(arguments).current_dir(folder);
    said_by(command.env("MPLCONFIGDIR", folder))
}

fn succeeds(program: &Path, arguments: &[&str]) -> bool {
    let output = Command::new(program).args(arguments).output();
    output.is_ok_and(|output| output.status.success())
}

fn begins_with(file: &Path, mark: &[u8]) {
    let bytes = std::fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    assert!(
        bytes.starts_with(mark),
        "{} begins otherwise",
        file.display()
    );
}

/// Runs the shell blocks of a guide. Returns the folder in which they ran and their output.
fn run_shell(guide: &str) -> Option<(TempDir, String)> {
    let there = |program: &str| succeeds(Path::new(program), &["--version"]);
    if !there("curl") || !there("jq") {
        skip("the guides need curl and jq");
        return None;
    }
    let (_data, service) = Service::fresh(&[]);
    let (folder, script) = (folder(), blocks(guide, "sh", &service));
    let said = run(Path::new("bash"), &["-euc", &script], folder.path());
    Some((folder, said))
}

#[test]
fn guide_to_forms_runs_as_it_stands() {
    let (folder, said) = or_skip!(run_shell("docs/formats.md"));
    assert!(
        said.contains("x_mm,y_mm,dx_mm,dy_mm,strip,traction_x_mpa"),
        "{said}"
    );
    assert!(
        said.contains("event: state") && said.contains("\n304\n"),
        "{said}"
    );
    for (file, mark) in [
        ("pressure.npz", b"PK".as_slice()),
        ("tractions.vtk", b"# vtk DataFile"),
        ("traction.svg", b"<svg "),
        ("zones.png", b"\x89PNG"),
        ("slip.png", b"\x89PNG"),
    ] {
        begins_with(&folder.path().join(file), mark);
    }
}

#[test]
fn guide_to_wheelsets_runs_as_it_stands() {
    let (_folder, said) = or_skip!(run_shell("docs/wheelset.md"));
    assert!(
        said.contains("\"radius_difference_mm\": 0.75") && said.contains("\"conicity\": 0.180"),
        "{said}"
    );
}

#[test]
fn guide_to_runs_runs_as_it_stands() {
    let (folder, said) = or_skip!(run_shell("docs/runs.md"));
    assert!(
        said.contains("row,km,section,status,method,normal_force_n,force_x_n"),
        "{said}"
    );
    assert!(said.contains("\"value\": \"straight\""), "{said}");
    begins_with(&folder.path().join("night.parquet"), b"PAR1");
}

#[test]
fn creep_curve_from_the_shell_runs_as_it_stands() {
    let (folder, said) = or_skip!(run_shell("docs/python.md"));
    let curve: Vec<f64> = said
        .lines()
        .filter_map(|line| line.split_once('\t')?.1.parse().ok())
        .collect();
    assert!(
        curve.len() == 25 && curve.is_sorted() && curve[24] > 0.9,
        "{said}"
    );
    begins_with(&folder.path().join("picture.svg"), b"<svg ");
    let loads: Vec<&str> = said
        .lines()
        .filter(|line| line.contains(",succeeded,"))
        .collect();
    assert_eq!(loads.len(), 3, "{said}");
}

#[test]
fn creep_curve_from_python_runs_as_it_stands() {
    let python = or_skip!(python());
    let (_data, service) = Service::fresh(&[]);
    let (folder, script) = (folder(), blocks("docs/python.md", "python", &service));
    let said = run(&python, &["-c", &script], folder.path());
    assert!(said.contains("largest force: 0.9"), "{said}");
    for picture in ["creep-curve.png", "tractions.png", "picture.png"] {
        begins_with(&folder.path().join(picture), b"\x89PNG");
    }
}

/// Returns a Python with the packages of the guide: `RAILHEAD_TEST_PYTHON` or `python3`.
pub fn python() -> Option<PathBuf> {
    let named = std::env::var_os("RAILHEAD_TEST_PYTHON");
    let python = named.map_or_else(|| PathBuf::from("python3"), PathBuf::from);
    let packages = ["-c", "import httpx, numpy, matplotlib"];
    if succeeds(&python, &packages) {
        return Some(python);
    }
    skip(
        "the guide for Python and NumPy need httpx, numpy and matplotlib; name a Python that has them in RAILHEAD_TEST_PYTHON",
    );
    None
}
