//! Reading `.g2o`: what is understood, what is refused and with which words.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests are tests

use std::path::Path;

use motorcade_graph::g2o::{Document, ReadOptions, parse, to_string};
use motorcade_graph::{GraphError, Options, optimise};

const UNIT: &str = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";

fn read(text: &str) -> Result<Document, GraphError> {
    parse(text, Path::new("some.g2o"), &ReadOptions::default())
}

fn refused(text: &str, line: usize, words: &str) {
    let error = read(text).unwrap_err().to_string();
    assert!(error.starts_with(&format!("some.g2o:{line}: ")) && error.contains(words), "{error}");
}

const TWO: &str = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 2\n";

#[test]
fn faults_are_named_with_their_line() {
    refused("VERTEX_SE3:QUAT 0 0 0 nan 0 0 0 1", 1, "finite");
    refused("\nVERTEX_SE3:QUAT 0 0 0 x 0 0 0 1", 2, "not a number");
    refused("VERTEX_SE3:QUAT 0 0 0 0 0 0 0", 1, "7 numbers expected, found 6");
    refused("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1 5", 1, "too many");
    refused("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0", 1, "quaternion is zero");
    refused("VERTEX_SE3:QUAT -1 0 0 0 0 0 0 1", 1, "not an id");
    refused(&format!("{TWO}VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1"), 3, "before, in line 2");
    refused(&format!("{TWO}EDGE_SE3:QUAT 0 7 1 0 0 0 0 0 1 {UNIT}"), 3, "vertex 7, which is nowhere");
    refused(&format!("{TWO}EDGE_SE3:QUAT 1 1 1 0 0 0 0 0 1 {UNIT}"), 3, "with itself");
    refused(&format!("{TWO}FIX 5"), 3, "FIX names vertex 5");
    let negative = UNIT.replace('1', "-1");
    refused(&format!("{TWO}EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 {negative}"), 3, "no eigenvalue is positive");
}

#[test]
fn unknown_tags_are_counted_and_kept_out() {
    let document = read(&format!(
        "# a comment\n{TWO}PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\nEDGE_SE3:QUAT 0 1 2 0 0 0 0 0 1 {UNIT}\nVERTEX_TRACKXYZ 4 1 2 3\nVERTEX_TRACKXYZ 5 1 2 3\nFIX 1\n"
    ))
    .unwrap();
    let tags: Vec<_> = document.summary.unknown_tags.iter().map(|(t, n)| (t.as_str(), *n)).collect();
    assert_eq!(tags, [("PARAMS_SE3OFFSET", 1), ("VERTEX_TRACKXYZ", 2)]);
    assert_eq!((document.vertices.len(), document.summary.fixed), (2, 1));
}

#[test]
fn indefinite_information_is_clamped_and_counted() {
    let bent = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 -0.001 0 0 1 0 1";
    let document = read(&format!("{TWO}EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 {bent}")).unwrap();
    assert_eq!(document.summary.clamped_information, 1);
    assert!((document.summary.worst_eigenvalue_ratio + 0.001).abs() < 1e-12);
}

#[test]
fn information_is_read_translation_first() {
    // Off by 2 m along x: weight 4 belongs to x in the file's first place.
    let weights = "4 0 0 0 0 0 1 0 0 0 0 1 0 0 0 9 0 0 9 0 9";
    let document = read(&format!("{TWO}EDGE_SE3:QUAT 0 1 3 0 0 0 0 0 1 {weights}")).unwrap();
    assert!((document.graph.cost().unwrap() - 16.0).abs() < 1e-12);
}

#[test]
fn planar_graphs_are_solved_and_written() {
    let text = "VERTEX_SE2 3 0 0 0\nVERTEX_SE2 5 1.2 0.1 1.5\nVERTEX_SE2 9 1 1.3 3\nFIX 3\n\
        EDGE_SE2 3 5 1 0 1.5707963267948966 10 0 0 10 0 20\nEDGE_SE2 5 9 1 0 1.5707963267948966 10 0 0 10 0 20\n\
        EDGE_SE2 9 3 1 1 3.141592653589793 5 0 0 5 0 7\n";
    let mut document = read(text).unwrap();
    assert!(document.graph.cost().unwrap() > 0.1);
    let report = optimise(&mut document.graph, &Options::default()).unwrap();
    assert!(report.final_cost < 1e-10, "{report:?}");
    let again = read(&to_string(&document.graph, &document.vertices)).unwrap();
    assert_eq!(again.summary.edges_se2, 3);
    assert!((again.graph.cost().unwrap() - document.graph.cost().unwrap()).abs() < 1e-12);
}
