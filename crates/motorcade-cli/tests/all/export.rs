//! `motorcade export`.

use std::fs;

use crate::common::{answer, drive, json, no_leftovers, run};

#[test]
fn a_run_goes_onto_the_map_and_into_a_scenario() {
    let folder = drive(16);
    run(folder.path(), "--detections none.csv").expect(3, &["none.csv"]);
    run(folder.path(), "--models none").expect(0, &[]);
    let placed = answer(folder.path(), "export out --out map --start -33.86,151.2,-90,12");
    assert!(placed.expect(0, &[]).stdout.contains("placed by --start\nmap"), "{}", placed.stdout);
    for name in ["drive.geojson", "drive.gpx", "drive.kml", "ego.oxts.csv", "drive.xosc", "export.json"] {
        assert!(folder.path().join("map").join(name).exists(), "{name}");
    }
    let start = &json(&folder.path().join("map/export.json"))["start"];
    assert_eq!(start["latitude_deg"].as_f64(), Some(-33.86));
    assert_eq!(fs::read_to_string(folder.path().join("map/ego.oxts.csv")).unwrap().lines().count(), 16);
    // Again: refused, then replaced; without a place on the earth the scenario alone.
    answer(folder.path(), "export out --out map").expect(1, &["map", "--force"]);
    let alone = answer(folder.path(), "export out --out map --force");
    assert!(alone.expect(0, &[]).stdout.contains("drive.xosc alone"), "{}", alone.stdout);
    assert!(!folder.path().join("map/drive.gpx").exists() && folder.path().join("map/drive.xosc").exists());
    no_leftovers(folder.path());
}

#[test]
fn places_and_tracks_that_cannot_be_are_refused() {
    let folder = drive(16);
    run(folder.path(), "--models none").expect(0, &[]);
    fs::write(folder.path().join("far.csv"), "time,latitude,longitude\n0,49,8\n1,49,8.0001\n2,49,8.0002\n")
        .unwrap();
    fs::write(folder.path().join("bad.gpx"), "<gpx><trk>").unwrap();
    for (arguments, code, said) in [
        ("--start 91,8,0", 1, "LATITUDE,LONGITUDE,HEADING"),
        ("--start 49,8,0 --track far.csv", 1, "cannot be used with"),
        ("--track nowhere.gpx", 3, "nowhere.gpx"),
        ("--track bad.gpx", 3, "bad.gpx"),
        ("--track far.csv --clock-offset 1000", 3, "clock offset"),
        ("--track far.csv --clock-offset 1,0", 1, "SECONDS,SIGMA"),
        ("--clock-offset 3", 1, "--track"),
    ] {
        answer(folder.path(), &format!("export out --out map {arguments}")).expect(code, &[said]);
        assert!(!folder.path().join("map").exists(), "{arguments}");
    }
    answer(folder.path(), "export nothing --out map").expect(3, &["nothing"]);
}
