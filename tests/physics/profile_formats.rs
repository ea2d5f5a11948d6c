//! Do profile files say what their formats mean?

use railhead::contact::geometry::formats::format::{Format, read};

use crate::profile_reference_files::reference_file;

const MINIPROF: &str = "Filename=test.ban\nProgramName=\nXYPoints=3\nColumnDef=X,Y,A\n\n 1.0\t2.0\t0.1\n\" 2.0\t1.5\t0.1\n3.0\t1.0\t0.2\n";

fn simpack(settings: &str) -> String {
    format!(
        "! a remark\nheader.begin\n  version = 1\n  type = 1 ! wheel\nheader.end\nspline.begin\n  type = 0\n{settings}\n  point.begin\n\
         ! 9.0 9.0\n 1.0E+00 2.0E+00\n 3.0 4.0 1.0 ! with a weight\n  point.end\nspline.end\n"
    )
}

#[test]
fn columns_may_be_separated_by_blanks_commas_semicolons_or_tabs() {
    for text in [
        "1 2\n3 4",
        "y,z\n1,2\n3,4\n",
        "# remark\n1;2\r\n3;4\r\n",
        "\u{feff}1\t2\n\n3\t4\n! end",
    ] {
        let contents = read(Format::Columns, text).unwrap();
        assert_eq!(contents.points, [[1.0, 2.0], [3.0, 4.0]], "{text:?}");
        assert_eq!((contents.mirror_y, contents.mirror_z), (None, None));
    }
}

#[test]
fn a_line_that_cannot_be_read_is_named() {
    for text in [
        "1 2\n3 4 5",
        "1 2\n3",
        "1 2\n3 four",
        "1 2\nNaN 4",
        "1 2\ninf 4",
        "1 2\ny z",
    ] {
        let fault = read(Format::Columns, text).unwrap_err();
        assert!(fault.starts_with("line 2:"), "{text:?}: {fault}");
    }
    assert_eq!(
        read(Format::Columns, "# nothing\n").unwrap_err(),
        "no points found"
    );
}

#[test]
fn decimal_commas_paths_and_other_formats_are_named_for_what_they_are() {
    for text in [
        "-36,4988;24,2590\n-36,3;24,1",
        "-36,4988 24,2590\n-36,3 24,1",
    ] {
        let fault = read(Format::Columns, text).unwrap_err();
        assert!(fault.starts_with("line 1:"), "{fault}");
        assert!(fault.contains("decimal comma"), "{fault}");
    }
    for path in [
        "profiles/rail.prr",
        "C:\\profiles\\wheel.prw",
        "./s1002.txt",
    ] {
        for format in [Format::Columns, Format::Simpack, Format::Miniprof] {
            let fault = read(format, path).unwrap_err();
            assert!(fault.contains("not its path"), "{path}: {fault}");
        }
    }
    for (text, format) in [(MINIPROF.to_owned(), "miniprof"), (simpack(""), "simpack")] {
        let fault = read(Format::Columns, &text).unwrap_err();
        assert!(fault.contains(format), "{format}: {fault}");
    }
}

#[test]
fn simpack_settings_are_applied() {
    let points = |settings: &str| read(Format::Simpack, &simpack(settings)).unwrap().points;
    assert_eq!(points(""), [[1.0, 2.0], [3.0, 4.0]]);
    assert_eq!(points(" mirror.y = 1"), [[-1.0, 2.0], [-3.0, 4.0]]);
    assert_eq!(
        points(" mirror.z = 1\n shift.y = 1.0"),
        [[2.0, -2.0], [4.0, -4.0]]
    );
    assert_eq!(
        points(" units.len.f = +1.0E+00"),
        [[1000.0, 2000.0], [3000.0, 4000.0]]
    );
    assert_eq!(
        points(" bound.y.min = 0.0\n bound.y.max = 2.0"),
        [[1.0, 2.0]]
    );
    let turned = points(" rotate = 90\n units.ang.f = 57.29577951308232");
    assert!((turned[0][0] + 2.0).abs() < 1e-12 && (turned[0][1] - 1.0).abs() < 1e-12);
    let contents = read(Format::Simpack, &simpack("")).unwrap();
    assert_eq!(
        (contents.wheel, contents.mirror_y, contents.mirror_z),
        (Some(true), Some(false), Some(false))
    );
}

#[test]
fn faulty_simpack_texts_are_refused() {
    assert!(
        read(Format::Simpack, "1 2\n3 4")
            .unwrap_err()
            .contains("point.begin")
    );
    assert!(
        read(Format::Simpack, &simpack(" shift.y = one"))
            .unwrap_err()
            .starts_with("line 8:")
    );
    assert!(
        read(Format::Simpack, "point.begin\n1 2\n1\npoint.end")
            .unwrap_err()
            .starts_with("line 3:")
    );
    assert!(
        read(Format::Simpack, "point.begin\n1 2\n")
            .unwrap_err()
            .contains("point.end")
    );
}

#[test]
fn miniprof_columns_are_found_by_their_names() {
    let contents = read(Format::Miniprof, MINIPROF).unwrap();
    assert_eq!(contents.points, [[1.0, 2.0], [2.0, 1.5], [3.0, 1.0]]);
    assert_eq!(contents.mirror_y, Some(true));
    let swapped = MINIPROF.replace("X,Y,A", "Y,X,A");
    assert_eq!(
        read(Format::Miniprof, &swapped).unwrap().points[0],
        [2.0, 1.0]
    );
}

#[test]
fn faulty_miniprof_texts_are_refused() {
    let refused =
        |from: &str, to: &str| read(Format::Miniprof, &MINIPROF.replace(from, to)).unwrap_err();
    assert_eq!(
        refused("XYPoints=3", "XYPoints=4"),
        "3 points found, but XYPoints says 4"
    );
    assert!(refused("X,Y,A", "A,B").starts_with("line 4:"));
    assert!(refused("3.0\t1.0", "3.0\tx").starts_with("line 8:"));
}

#[test]
fn one_rail_in_two_formats_is_one_rail() {
    let (Some(ban), Some(prr)) = (
        reference_file("profiles/MBench_UIC60_v3.ban"),
        reference_file("profiles/MBench_UIC60_v3.prr"),
    ) else {
        return;
    };
    let (ban, prr) = (
        read(Format::Miniprof, &ban).unwrap(),
        read(Format::Simpack, &prr).unwrap(),
    );
    assert_eq!(ban.points.len(), prr.points.len());
    for (from, to) in ban.points.iter().zip(&prr.points) {
        assert!((from[0] + to[0]).abs() < 1e-5 && (from[1] - to[1]).abs() < 1e-5);
    }
}
