//! `motorcade run --parquet` and `motorcade tables`.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::path::Path;

use crate::common::{answer, drive, json, no_leftovers, rows, run};
use motorcade_tables::read_rows;

/// Every cell of a CSV file is the cell of a Parquet file of this name, row by row.
#[track_caller]
fn same_cells(csv: &Path, parquet: &Path) {
    let text = fs::read_to_string(csv).unwrap();
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let (expected, found) = (rows(csv), read_rows(parquet).unwrap());
    assert_eq!(expected.len(), found.len());
    for (expected, found) in expected.iter().zip(&found) {
        for (name, cell) in head.iter().zip(expected) {
            let (a, b) = (cell.parse::<f64>(), found[*name].parse::<f64>());
            assert!(*cell == found[*name] || a.is_ok() && a == b, "{name}: {cell} {}", found[*name]);
        }
    }
}

#[test]
fn runs_are_joined_into_a_dataset() {
    let folder = drive(16);
    let inside = |name: &str| folder.path().join(name);
    run(folder.path(), "--parquet").expect(0, &[]);
    let listed = json(&inside("out/run.json"))["files"].to_string();
    assert!(listed.contains("\"frames.parquet\"") && listed.contains("\"tracks.parquet\""), "{listed}");
    same_cells(&inside("out/frames.csv"), &inside("out/frames.parquet"));
    same_cells(&inside("out/tracks.csv"), &inside("out/tracks.parquet"));
    // A column of a run that the tables do not know would have no description.
    let tables =
        [motorcade_tables::frames, motorcade_tables::tracks].map(|f| f(&inside("out"), "x").unwrap());
    let columns = tables.iter().flat_map(|table| &table.table.columns);
    let unknown: Vec<_> = columns.filter(|c| c.description.is_empty()).map(|c| &c.name).collect();
    assert!(unknown.is_empty(), "{unknown:?}");
    // The same run again is known; without the files it is another one.
    run(folder.path(), "--parquet").expect(0, &[]);
    run(folder.path(), "").expect(1, &["--force"]);
    let usual = "run frames --calibration camera.toml --height 1.5 --threads 1";
    answer(folder.path(), &format!("{usual} --frames 4.. --out later")).expect(0, &[]);

    let joined = answer(folder.path(), "tables out later --out tables");
    assert!(joined.expect(0, &[]).stdout.contains("2 drives\ntables"), "{}", joined.stdout);
    // The same bytes as those of the run.
    let bytes = |name: &str| fs::read(inside(name)).unwrap();
    assert!(bytes("tables/frames/out.parquet") == bytes("out/frames.parquet"));
    assert!(bytes("tables/tracks/out.parquet") == bytes("out/tracks.parquet"));
    same_cells(&inside("later/frames.csv"), &inside("tables/frames/later.parquet"));
    let drives = read_rows(&inside("tables/drives.parquet")).unwrap();
    let cell = |k: usize, name: &str| drives[k][name].as_str();
    assert_eq!((cell(0, "drive_id"), cell(0, "frames"), cell(0, "input")), ("out", "16", "frames"));
    assert_eq!((cell(1, "drive_id"), cell(1, "frames"), cell(1, "status")), ("later", "12", "complete"));
    assert_eq!(json(&inside("tables/tables.json"))["drives"][1]["run"], "later");

    // Again: refused, then replaced, what is no longer part of it removed.
    answer(folder.path(), "tables out --out tables").expect(1, &["tables", "--force"]);
    answer(folder.path(), "tables out --out tables --force").expect(0, &[]);
    assert!(!inside("tables/frames/later.parquet").exists() && inside("tables/frames/out.parquet").exists());
    no_leftovers(folder.path());
}

#[test]
fn runs_that_do_not_fit_leave_nothing() {
    let folder = drive(16);
    let inside = |name: &str| folder.path().join(name);
    run(folder.path(), "").expect(0, &[]);
    fs::create_dir(inside("other")).unwrap();
    fs::write(inside("other/run.json"), "{}").unwrap();
    for (runs, code, said) in [
        ("out other", 3, "other/frames.csv"),
        ("out nowhere", 3, "nowhere"),
        ("out other/../out", 1, "out and other/../out"),
        ("", 1, "<RUN>"),
    ] {
        answer(folder.path(), &format!("tables {runs} --out tables")).expect(code, &[said]);
        assert!(!inside("tables").exists(), "{runs}");
    }
    no_leftovers(folder.path());
}
