//! Manifests that read, and what is said of those that do not.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;

use motorcade_fleet::{Drive, Manifest};

fn read(name: &str, text: &str) -> Result<Vec<Drive>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    let prefix = format!("{}:", path.display());
    let manifest = Manifest::read(&path, &[]);
    manifest.map(|m| m.drives).map_err(|e| e.to_string().replace(&prefix, ""))
}

#[track_caller]
fn refused(name: &str, text: &str, said: &[&str]) {
    let error = read(name, text).unwrap_err();
    assert!(said.iter().all(|part| error.contains(part)), "{error}");
}

#[test]
fn rows_become_drives_in_order() {
    let text = "id,input,height,settings\none,a.mp4,1.4,a.b=1;c.d=2\n\"two\",\"b, c.mp4\",auto,\n,videos/d e.mp4,,\n";
    let drives = read("drives.csv", text).unwrap();
    let ids: Vec<&str> = drives.iter().map(|d| d.id.as_str()).collect();
    assert_eq!(ids, ["one", "two", "d_e"]);
    assert_eq!(drives.iter().map(|d| d.line).collect::<Vec<_>>(), [2, 3, 4]);
    assert!(drives[1].input.ends_with("b, c.mp4") && drives[1].input.is_absolute());
    let split = "input,sequence,camera\ntraining,0003,2\ntraining,0005,3\n";
    let ids: Vec<String> = read("split.csv", split).unwrap().into_iter().map(|d| d.id).collect();
    assert_eq!(ids, ["training-0003-2", "training-0005-3"]);
}

#[test]
fn json_lines_say_the_same() {
    let text = "{\"input\": \"a.mp4\", \"height\": 1.4, \"keep_perception\": true, \"fps\": null}\n\n{\"id\": \"b\", \"input\": \"b\", \
                \"vehicle-poses\": [\"p.csv\", \"q.csv\"]}\n";
    let drives = read("drives.jsonl", text).unwrap();
    assert_eq!((drives[0].id.as_str(), drives[1].id.as_str(), drives[1].line), ("a", "b", 3));
    refused("drives.jsonl", "{\"input\": {}}\n", &["1: ", "`input`", "a text"]);
    refused("drives.jsonl", "{\"input\": \"a\"}\n[]\n", &["2: ", "one JSON object"]);
}

#[test]
fn a_mistake_is_named_with_line_and_column() {
    refused("m.csv", "input,hight\na,1\n", &["1: column `hight` is not known", "height"]);
    refused("m.csv", "input,input\na,b\n", &["1: column `input` is there twice"]);
    refused("m.csv", "input,height\na,1.4\nb,tall\n", &["3: column `height`: `tall`", "metres, or `auto`"]);
    refused("m.csv", "input,camera\na,-1\n", &["2: column `camera`: `-1`", "whole number"]);
    refused("m.csv", "input,settings\na,odometry\n", &["2: column `settings`", "stage.key=value"]);
    refused("m.csv", "id,height\na,1\n", &["2: column `input`: expected"]);
    refused("m.csv", "input,height\na,1,2\n", &["2: ", "3 fields"]);
    refused("m.csv", "id,input\nx,a\ny,b\nX,c\n", &["4: column `id`: `X` is the id of line 2 too"]);
    refused("m.csv", "input\nday/a.mp4\nnight/a.mp4\n", &["3: column `id`: `a`", "its own `id`"]);
    for id in ["..", "a/b", "-x", ".hidden", "a b", "ä"] {
        refused("m.csv", &format!("id,input\n{id},a\n"), &["2: column `id`", "cannot name a directory"]);
    }
    refused("m.txt", "input\na\n", &["1: ", ".csv"]);
}

#[test]
fn parquet_says_the_same() {
    use motorcade_tables::{Column, Table, Values, parquet_bytes};
    let folder = tempfile::tempdir().unwrap();
    let column = |name: &str, values| Column {
        name: name.into(),
        unit: String::new(),
        description: String::new(),
        values,
    };
    let inputs = Values::Text(vec![Some("a.mp4".into()), Some("b.mp4".into())]);
    let write = |name: &str, heights| {
        let columns = vec![column("input", inputs.clone()), column(name, Values::F64(heights))];
        let table = Table { name: "drives".into(), description: String::new(), columns };
        let path = folder.path().join("drives.parquet");
        fs::write(&path, parquet_bytes(&table, &[]).unwrap()).unwrap();
        Manifest::read(&path, &[])
    };
    let drives = write("height", vec![Some(1.4), None]).unwrap().drives;
    assert_eq!((drives[0].id.as_str(), drives[1].line), ("a", 2));
    let error = write("hight", vec![Some(1.4), None]).unwrap_err().to_string();
    assert!(error.contains("drives.parquet:1: column `hight` is not known"), "{error}");
    let other = folder.path().join("text.parquet");
    fs::write(&other, "input\na\n").unwrap();
    assert!(Manifest::read(&other, &[]).unwrap_err().to_string().contains("text.parquet"));
}
