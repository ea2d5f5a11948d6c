//! Tests that profile files are read as their formats define.

use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::geometry::formats::{Format, ProfileFile, read};
use serde_json::json;

use crate::profile_cases::generated;
use crate::profile_reference_files::reference_file;
use crate::profile_shapes::rail_60e1;

const MINIPROF: &str = "Filename=test.ban\nProgramName=\nXYPoints=3\nColumnDef=X,Y,A\n\n 1.0\t2.0\t0.1\n 2.0\t1.5\t0.1\n3.0\t1.0\t0.2\n";

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

/// Returns a rail head of 60E1 with four decimals, so that its text is exact.
fn section() -> Vec<[f64; 2]> {
    let four_decimals = |part: f64| (part * 1e4).round() / 1e4;
    let points = rail_60e1().into_iter();
    points.map(|point| point.map(four_decimals)).collect()
}

/// Returns the rows of a text, each written by a function.
fn rows(write: impl Fn(usize, &str, &str) -> String) -> String {
    let points = section();
    let row = |(k, [y, z]): (usize, &[f64; 2])| write(k, &y.to_string(), &z.to_string());
    points.iter().enumerate().map(row).collect()
}

fn plain() -> String {
    rows(|_, y, z| format!("{y} {z}\n"))
}

#[track_caller]
fn is_section(format: Format, text: &str, form: &str) -> ProfileFile {
    let contents = read(format, text).unwrap_or_else(|fault| panic!("{form}: {fault}"));
    let is_same = contents.points == section();
    assert!(is_same, "{form}: {} points", contents.points.len());
    contents
}

/// A row 0.5 mm off the section, so that reading it changes the result.
const OFF: &str = "-20.0 1.5 0 0 7";

fn with_line(text: &str, k: usize, line: &str) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    lines.insert(k, line);
    lines.join("\n")
}

/// Returns the same rows with different line ends, encodings, separators and decimal signs.
fn written_forms() -> Vec<(&'static str, String)> {
    let commas = |text: String| text.replace('.', ",");
    let in_utf16 = plain().chars().flat_map(|c| [c, '\0']).collect();
    vec![
        ("plain", plain()),
        ("carriage returns", plain().replace('\n', "\r")),
        ("carriage returns doubled", plain().replace('\n', "\r\r\n")),
        ("byte order mark", format!("\u{feff}{}", plain())),
        ("UTF-16 as single characters", in_utf16),
        ("a DOS end of file", plain() + "\u{1a}"),
        ("tabs", rows(|_, y, z| format!("\t{y}\t{z}\t\n"))),
        ("commas", rows(|_, y, z| format!("{y},{z}\n"))),
        ("quoted cells", rows(|_, y, z| format!("\"{y}\",\"{z}\"\n"))),
        (
            "decimal commas and semicolons",
            commas(rows(|_, y, z| format!("{y};{z};\n"))),
        ),
        (
            "decimal commas and blanks",
            commas(rows(|_, y, z| format!("{y}  {z}\n"))),
        ),
        (
            "decimal commas and commas",
            commas(rows(|_, y, z| format!("{y}, {z}\n"))),
        ),
        (
            "exponents of Fortran",
            rows(|_, y, z| format!("{y}D0 {z}d+00\n")),
        ),
        (
            "signs of minus of a text program",
            plain().replace('-', "\u{2212}"),
        ),
    ]
}

/// Returns texts with more than the points: columns, words, titles, a header, a footer.
fn extended_forms() -> Vec<(&'static str, String)> {
    let behind =
        |words: &str| rows(|k, y, z| format!("{y} {z}{}\n", if k == 9 { words } else { "" }));
    let reversed = rows(|k, y, z| format!("{k};{z};{y}\n"));
    let separated = rows(|_, y, z| format!("{y},{z}\n"));
    let parted = rows(|k, y, z| format!("{y} {z}\n{}", if k % 5 == 0 { "\n\n" } else { "" }));
    let header = "Site 12\n24/3/1994 10:20\n83\n\n";
    vec![
        (
            "further columns",
            rows(|k, y, z| format!("{y} {z} 0.5 {k}\n")),
        ),
        ("a weight in one row", behind(" 0.5")),
        ("words behind a row", behind(" dent (see photo)")),
        ("words that begin like numbers", behind(" 2nd time 12:30")),
        ("titles", format!("y z\n{}", plain())),
        ("titles in another order", format!("No;Z;Y\n{reversed}")),
        ("titles of MiniProf", format!("X,Y\n{separated}")),
        (
            "a first column without a title",
            rows(|k, y, z| format!("{}{},{y},{z}\n", if k == 0 { ",y,z\n" } else { "" }, 3 * k)),
        ),
        (
            "a count of rows without a title",
            rows(|k, y, z| format!("{}{k}\t{y}\t{z}\n", if k == 0 { "\ty\tz\n" } else { "" })),
        ),
        (
            "a title that begins with another one",
            rows(|k, y, z| format!("{}9.5;{y};{z}\n", if k == 0 { "z raw;y;z\n" } else { "" })),
        ),
        (
            "titles in braces",
            "{ y z w }\n".to_owned() + &rows(|_, y, z| format!("{y} {z} 1\n")),
        ),
        (
            "a word before the titles",
            "Data: z raw y\n".to_owned() + &rows(|_, y, z| format!("{z} 9.5 {y}\n")),
        ),
        (
            "a header of words, a date and a count",
            header.to_owned() + &plain(),
        ),
        ("an end of words", plain() + "\nEND\n"),
        ("empty lines", parted),
    ]
}

#[test]
fn a_section_is_the_same_in_every_form_of_columns_that_people_write() {
    for (form, text) in written_forms().iter().chain(&extended_forms()) {
        is_section(Format::Columns, text, form);
    }
}

#[test]
fn remarks_and_rows_commented_out_are_no_points() {
    for sign in ["#", "%", "!", "$", "//", "\"", " # ", "\t% "] {
        let remark = format!("  {sign} {OFF}");
        let behind = |k| if k == 11 { remark.as_str() } else { "" };
        let text = rows(|k, y, z| format!("{y} {z}{}\n", behind(k)));
        is_section(Format::Columns, &text, sign);
    }
    for sign in ["#", "%", "!", "$", "//", "\"", "'", ";", "  \" ", "## "] {
        for words in [OFF, " note"] {
            let text = with_line(&plain(), 40, &format!("{sign}{words}"));
            is_section(Format::Columns, &text, sign);
        }
    }
}

fn miniprof_rows() -> String {
    rows(|_, y, z| format!(" {y}\t{z}\t0.1\t663810000.0\n"))
}

#[test]
fn a_section_is_the_same_in_every_form_of_miniprof_that_instruments_write() {
    let count = section().len();
    let modern = format!(
        "Filename=a.ban\nStock=%Talent\nUOF1=#title\n\"RefPoint1=\"\n\"ColumnDef=X,Y,A\"\nXYPoints={count}\nColumnDef=X,Y,A,K\n\n"
    );
    let words = format!("Filename a.ban\nDate 2020-01-01\nXYPoints {count}\nColumnDef X,Y,A,K\n\n");
    let old = "#MINIWHEELPROF\na_T(R).whl\nMINIPROF 2020\nStock.......:\n\" 32.50 28.00 10.80\n(Sd/Sh/qR)\n\n".to_owned();
    let dos = "MINIPROF 101 148 1994 3 24\na.prd\nStock.......: \nWheel ID....:\n".to_owned();
    for (form, text) in [
        ("with =", modern.clone() + &miniprof_rows()),
        ("without =", words.clone() + &miniprof_rows()),
        ("with :", modern.replace('=', ": ") + &miniprof_rows()),
        ("in capitals", modern.to_uppercase() + &miniprof_rows()),
        ("in small letters", modern.to_lowercase() + &miniprof_rows()),
        (
            "carriage returns",
            (modern.clone() + &miniprof_rows()).replace('\n', "\r"),
        ),
        (
            "without an empty line",
            modern.replace("\n\n", "\n") + &miniprof_rows(),
        ),
        ("without a header", miniprof_rows()),
        ("old header", old.clone() + &miniprof_rows()),
        ("DOS header", dos.clone() + "\n" + &miniprof_rows()),
        (
            "decimal commas",
            modern.clone() + &miniprof_rows().replace('.', ","),
        ),
        (
            "a quoted row",
            modern.clone() + &with_line(&miniprof_rows(), 30, &format!("\" {OFF} % too close")),
        ),
    ] {
        let contents = is_section(Format::Miniprof, &text, form);
        assert_eq!(
            (contents.mirror_y, contents.wrong_count),
            (Some(true), None),
            "{form}"
        );
        assert_eq!(contents.header_rows, None, "{form}");
    }
}

#[test]
fn rows_of_numbers_in_a_header_are_no_points() {
    let [y, z] = section()[0];
    let dos = "MINIPROF 101 148 1994 3 24\na.prd\nStock.......: \nWheel ID....:\n".to_owned();
    // Rows of numbers above the points: the dimensions of a wheel.
    for (form, header, line) in [
        (
            "behind words",
            dos.clone() + "32.58 37.11 14.71  (Sd/Sh/qR)\n\n",
            5,
        ),
        ("without words", dos.clone() + "32.58 37.11 14.71\n\n", 5),
        (
            "without an empty line",
            dos.clone() + "32.58 37.11 14.71\n",
            5,
        ),
        (
            "before words",
            dos.replace("a.prd", "32.58 37.11 14.71") + "\n",
            2,
        ),
        (
            "of the same length",
            dos.clone() + "32.58 37.11 14.71 1\n0 0 0 0\n\n",
            5,
        ),
        (
            "near the first point",
            dos.clone() + &format!("{} {} 10.2\n", y + 0.1, z + 0.1),
            5,
        ),
    ] {
        let contents = is_section(Format::Miniprof, &(header + &miniprof_rows()), form);
        let (_, first) = contents
            .header_rows
            .unwrap_or_else(|| panic!("{form}: no remark"));
        assert_eq!(first, line, "{form}");
    }
    // A part of the points separated by an empty line is not a header.
    let cut = "ColumnDef=X,Y\n\n".to_owned() + &with_line(&miniprof_rows(), 5, "");
    assert_eq!(
        is_section(Format::Miniprof, &cut, "cut off").header_rows,
        None
    );
}

#[test]
fn a_count_that_was_not_edited_with_the_rows_is_remarked() {
    let text = |stated: usize| format!("XYPoints={stated}\nColumnDef=X,Y\n\n{}", plain());
    let count = section().len();
    for stated in [count - 1, count + 20] {
        let contents = is_section(Format::Miniprof, &text(stated), "count");
        assert_eq!(contents.wrong_count, Some(stated));
    }
    let mut case = generated();
    case["contact"]["rail"] = json!({ "format": "miniprof", "text": text(count - 1), "mirror_y": false, "mirror_z": false });
    let checked = check(&case, &Limits::default()).unwrap();
    let remark = checked
        .remarks
        .into_iter()
        .find(|remark| remark.code == "profile-count-differs");
    assert_eq!(remark.unwrap().pointer.as_deref(), Some("/contact/rail"));
}

#[test]
fn a_line_that_cannot_be_read_is_shown_with_its_place() {
    for (text, line, words) in [
        ("1 2\n3", 2, vec!["\"3\""]),
        ("1 2\n3 four", 2, vec!["\"3 four\"", "\"four\" at column 3"]),
        ("1 2\nNaN 4", 2, vec!["\"NaN\" at column 1"]),
        ("1 2\ninf 4", 2, vec!["\"inf\""]),
        ("1 2\n3 4.5.6", 2, vec!["\"4.5.6\" at column 3"]),
        ("1 2\n3 4,0O", 2, vec!["\"4,0O\" at column 3"]),
        ("1 2\n3 ******", 2, vec!["\"******\""]),
        ("1 2\n3 1.#QNAN 5", 2, vec!["\"1.#QNAN\""]),
        (
            "1 2\ncorner\n3 4\n5 6\n\n",
            2,
            vec!["\"corner\" at column 1"],
        ),
        ("1.0 2.x\n3 4\n5 6", 1, vec!["\"2.x\" at column 5"]),
        (
            "1.5 2.5\n3.5 4,5",
            2,
            vec![
                "\"4,5\" at column 5",
                "decimal commas and decimal points are mixed",
            ],
        ),
        (
            "1.5 2.5\n3,5 4,5\n5.5 6.5",
            2,
            vec!["decimal commas and decimal points are mixed"],
        ),
    ] {
        // The line follows many rows, so that it is not taken for a header.
        let text = if line == 1 {
            text.to_owned()
        } else {
            format!("{}{text}", "0 1\n".repeat(8))
        };
        let line = if line == 1 { 1 } else { line + 8 };
        let fault = read(Format::Columns, &text).unwrap_err();
        assert!(
            fault.starts_with(&format!("line {line}:")),
            "{text:?}: {fault}"
        );
        for word in words {
            assert!(fault.contains(word), "{text:?}: {fault}");
        }
        assert!(
            fault.contains("row of finite numbers is needed")
                && fault.contains("remarks begin with"),
            "{fault}"
        );
    }
}

#[test]
fn whole_lines_are_shown_and_texts_without_points_say_why() {
    // The whole line is shown, up to about a hundred characters.
    let long = format!("{}3 {}", "0 1\n".repeat(8), "x".repeat(200));
    assert!(
        read(Format::Columns, &long)
            .unwrap_err()
            .contains(&"x".repeat(200))
    );
    let endless = format!("{}3 {}", "0 1\n".repeat(8), "x".repeat(100_000));
    assert!(read(Format::Columns, &endless).unwrap_err().len() < 3000);
    let many = read(Format::Columns, &"1 2\n".repeat(100_001)).unwrap_err();
    assert!(many.contains("more than 100000 lines"), "{many}");
    let fault = read(Format::Columns, "# nothing\n").unwrap_err();
    assert!(
        fault.starts_with("no points found; each needs a line"),
        "{fault}"
    );
    let fault = read(Format::Columns, "\"1 2\n\"3 4\n").unwrap_err();
    assert!(fault.contains("2 rows are remarks"), "{fault}");
    let inches = read(Format::Columns, &("y[\"] z[\"]\n".to_owned() + &plain())).expect("inches");
    assert_eq!(inches.unit_mm, Some(25.4));
    let named = "id;y;z\n".to_owned() + &rows(|k, y, z| format!("P{k};{y};{z}\n"));
    let fault = read(Format::Columns, &named).unwrap_err();
    assert!(
        fault.contains("line 2, \"P0;") && fault.contains("remove the first column"),
        "{fault}"
    );
    let counted = rows(|k, y, z| format!("{k} {y} {z}\n"));
    let fault = read(Format::Columns, &counted).unwrap_err();
    assert!(
        fault.contains("the first column counts the rows"),
        "{fault}"
    );
}

#[test]
fn paths_and_other_formats_are_named_for_what_they_are() {
    for path in [
        "profiles/rail.prr",
        "C:\\profiles\\wheel.prw",
        "./s1002.txt",
        "crossing.slcs",
    ] {
        for format in [Format::Columns, Format::Simpack, Format::Miniprof] {
            let fault = read(format, path).unwrap_err();
            assert!(fault.contains("the content of the file"), "{path}: {fault}");
        }
    }
    for (text, own) in [
        (MINIPROF.to_owned(), Format::Miniprof),
        (
            format!("#MINIWHEELPROF\nMINIPROF 2020\n\n{}", plain()),
            Format::Miniprof,
        ),
        (simpack(""), Format::Simpack),
        (simpack("").to_uppercase(), Format::Simpack),
    ] {
        for other in [Format::Columns, Format::Simpack, Format::Miniprof] {
            if other == own {
                assert!(read(own, &text).is_ok());
                continue;
            }
            let fault = read(other, &text).unwrap_err();
            let name = if own == Format::Simpack {
                "simpack"
            } else {
                "miniprof"
            };
            assert!(
                fault.contains(&format!("the format {name}")),
                "{name} as {other:?}: {fault}"
            );
        }
    }
    // Keywords in comments have no effect.
    is_section(
        Format::Columns,
        &format!("# ColumnDef=X,Y\n{}", plain()),
        "a remark",
    );
    let vampire = format!(
        "RAILPROFILE\nnew rail\nGAUGEPOINT EUROPEAN\nGAUGE 1435.0\n{}",
        plain()
    );
    assert!(
        read(Format::Columns, &vampire)
            .unwrap_err()
            .contains("Vampire")
    );
}

#[test]
fn cross_sections_that_vary_are_refused_with_what_to_send() {
    let along = "% a crossing\n  0.0  1000.0  S_OFFSET [m], S_SCALE [mm/m]\n  3  NSLC\n  0 0 0  NFEAT\n  1  S_METHOD\n\n -75.0 'nose/slice_1.prr'\n -49.3 'nose/slice_2.prr' % toe\n  50.0 'nose/slice_3.prr'\n";
    let around = along
        .replace("S_OFFSET", "TH_OFFSET")
        .replace("S_SCALE", "TH_SCALE");
    let bare = "0.0 1.0\n2\n0 0 0\n1\n0.0 'a/slice_1.txt'\n0.5 'a/slice_2.txt'\n";
    for (text, words) in [
        (
            along,
            "vary along the track (.slcs), the first in \"nose/slice_1.prr\"",
        ),
        (&along.to_lowercase(), "vary along the track (.slcs)"),
        (&around, "vary around the wheel (.slcw)"),
        (
            bare,
            "vary along the track (.slcs) or around the wheel (.slcw)",
        ),
    ] {
        for format in [Format::Columns, Format::Simpack, Format::Miniprof] {
            let fault = read(format, text).unwrap_err();
            assert!(
                fault.contains(words) && fault.contains("send the text of the slice"),
                "{fault}"
            );
        }
    }
}

#[test]
fn units_of_files_are_honoured() {
    let read_mm = |format: Format, text: &str| {
        let contents = read(format, text).unwrap();
        (contents.points[0], contents.unit_mm)
    };
    for text in [
        "y [m] z [m]\n0.001 0.002",
        "y (m);z (m)\n0.001;0.002",
        "y_m,z_m\n0.001,0.002",
        "Y Z\n[m] [m]\n0.001 0.002",
        "units: m\n0.001 0.002",
        "[UNITS]\n LENGTH = 'meter'\n{y z}\n0.001 0.002",
    ] {
        assert_eq!(
            read_mm(Format::Columns, text),
            ([1.0, 2.0], Some(1000.0)),
            "{text}"
        );
    }
    assert_eq!(
        read_mm(Format::Columns, "y [mm] z [mm]\n1 2"),
        ([1.0, 2.0], Some(1.0))
    );
    assert_eq!(read_mm(Format::Columns, "y z\n1 2"), ([1.0, 2.0], None));
    assert_eq!(
        read_mm(Format::Miniprof, "Units=inch\nColumnDef=X,Y\n\n1 2"),
        ([25.4, 50.8], Some(25.4))
    );
    assert_eq!(
        read_mm(Format::Simpack, &simpack(" units.len = 'm'")),
        ([1000.0, 2000.0], Some(1000.0))
    );
    // The factor takes precedence over the unit name.
    assert_eq!(
        read_mm(
            Format::Simpack,
            &simpack(" units.len = 'm'\n units.len.f = 1000")
        ),
        ([1.0, 2.0], Some(1.0))
    );
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
    for unit in ["units.ang.f = 57.29577951308232", "units.ang = 'deg'"] {
        let turned = points(&format!(" rotate = 90\n {unit}"));
        assert!((turned[0][0] + 2.0).abs() < 1e-12 && (turned[0][1] - 1.0).abs() < 1e-12);
    }
    let contents = read(Format::Simpack, &simpack("")).unwrap();
    assert_eq!(
        (contents.wheel, contents.mirror_y, contents.mirror_z),
        (Some(true), Some(false), Some(false))
    );
}

#[test]
fn simpack_is_read_in_any_case_and_order_with_remarks_of_every_kind() {
    let other_order = "SPLINE.BEGIN\n POINT.BEGIN\n%  9 9\n\" 9 9\n# 9 9\n// 9 9\n 1.0 2.0 % corner\n 3.0 4.0 1.0 corner\n POINT.END\n FILE = '-'\n \
                       MIRROR.Y = 1\n TYPE = 0\nSPLINE.END\nHEADER.BEGIN\n TYPE = 1\nHEADER.END\n";
    for text in [
        other_order.to_owned(),
        other_order.replace('\n', "\r"),
        other_order.to_lowercase(),
    ] {
        let contents = read(Format::Simpack, &text).unwrap();
        assert_eq!(contents.points, [[-1.0, 2.0], [-3.0, 4.0]], "{text}");
        assert_eq!(contents.wheel, Some(true));
    }
}

#[test]
fn faulty_simpack_texts_are_refused() {
    assert!(
        read(Format::Simpack, "1 2\n3 4")
            .unwrap_err()
            .contains("point.begin")
    );
    let elsewhere = "header.begin\nversion = 1\ntype = 0\nheader.end\nSpline.Begin\n  FILE = 'Rail%1.dat' ! points\nspline.end\n";
    let fault = read(Format::Simpack, elsewhere).unwrap_err();
    assert!(
        fault.contains("in another file, Rail%1.dat: send its text"),
        "{fault}"
    );
    let twice = simpack("").replace("spline.end", "point.begin\n1 2\npoint.end");
    assert!(
        read(Format::Simpack, &twice)
            .unwrap_err()
            .contains("second block")
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
    assert!(refused("X,Y,A", "A,B").starts_with("line 4:"));
    assert!(refused(" 2.0\t1.5", " 2.0\tx").starts_with("line 7:"));
    assert!(refused("X,Y,A", "A,B,C,X,Y").contains("at least 5 finite numbers"));
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
    // Rows that begin with a quote are commented out in the MiniProf file.
    assert!(ban.points.len() < prr.points.len());
    for from in &ban.points {
        let is_same =
            |to: &&[f64; 2]| (from[0] + to[0]).abs() < 1e-5 && (from[1] - to[1]).abs() < 1e-5;
        assert!(prr.points.iter().any(|to| is_same(&to)), "{from:?}");
    }
}
