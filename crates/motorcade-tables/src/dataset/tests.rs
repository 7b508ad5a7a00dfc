use super::*;

use std::path::PathBuf;

use crate::drive::named;
use crate::read_rows;
use crate::run::tests::write_run;

#[test]
fn runs_become_files_of_one_dataset() {
    let folder = tempfile::tempdir().unwrap();
    let runs: Vec<PathBuf> = ["morning", "evening"].map(|name| write_run(&folder.path().join(name))).into();
    let out = folder.path().join("tables");
    let write = |force| {
        let directory = OutputDirectory::open(&out, TABLES_RECORD, force).unwrap();
        join(&named(&runs).unwrap(), &directory, &["motorcade".into()]).unwrap();
    };
    write(false);
    let drives = read_rows(&out.join("drives.parquet")).unwrap();
    let row = &drives[1];
    assert_eq!((row["drive_id"].as_str(), row["input"].as_str()), ("evening", "drive.mp4"));
    assert_eq!(
        (row["frames"].as_str(), row["frames_tracked"].as_str(), row["vehicles"].as_str()),
        ("3", "2", "1")
    );
    assert_eq!((row["duration_s"].as_str(), row["length_m"].as_str()), ("60.5", "12.5"));
    assert_eq!((row["warnings"].as_str(), row["status"].as_str()), ("1", "complete"));
    let tracks = read_rows(&out.join("tracks/morning.parquet")).unwrap();
    assert_eq!(
        (tracks.len(), tracks[0]["drive_id"].as_str(), tracks[0]["class"].as_str()),
        (2, "morning", "Car")
    );
    let bytes = fs::read(out.join("frames/morning.parquet")).unwrap();
    write(true);
    assert_eq!(fs::read(out.join("frames/morning.parquet")).unwrap(), bytes);
}

#[test]
fn a_run_that_does_not_read_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let runs: Vec<PathBuf> = ["good", "bad"].map(|name| write_run(&folder.path().join(name))).into();
    fs::remove_file(runs[1].join("ego.tum")).unwrap();
    let out = folder.path().join("tables");
    let directory = OutputDirectory::open(&out, TABLES_RECORD, false).unwrap();
    let error = join(&named(&runs).unwrap(), &directory, &[]).unwrap_err();
    assert!(error.to_string().contains("ego.tum") && error.exit_code() == 3, "{error}");
    assert!(!out.exists());
}
