//! `loops.csv`: places seen again; `map_matches.csv`: places of a kept map.

use std::io::{self, Write};
use std::path::Path;

use motorcade_geometry::{Camera, Pose};
use nalgebra::Matrix6;

use super::file;
use crate::closed_loop::ClosedLoop;
use crate::error::Result;
use crate::kept_map::MapMatch;
use crate::result::RunResult;

const LOOP_COLUMNS: &str =
    "later_frame,earlier_frame,tx,ty,tz,qx,qy,qz,qw,sigma_m,sigma_rad,inliers,share,rms_px,weight,closed";
const MAP_COLUMNS: &str =
    "frame,map_row,tx,ty,tz,qx,qy,qz,qw,sigma_m,sigma_rad,inliers,share,rms_px,weight,holds";

/// Writes the tables where there is something in them.
pub(super) fn write(folder: &Path, result: &RunResult) -> Result<()> {
    let loops = &result.loops.all;
    if !loops.is_empty() {
        file(&folder.join("loops.csv"), |out| table(out, result))?;
    }
    let matches = result.loops.kept.as_ref().map_or(&[][..], |kept| &kept.matches);
    if !matches.is_empty() {
        file(&folder.join("map_matches.csv"), |out| map_table(out, result, matches))?;
    }
    Ok(())
}

fn table(out: &mut impl Write, result: &RunResult) -> io::Result<()> {
    writeln!(out, "{LOOP_COLUMNS}")?;
    let number = |row: usize| result.frames.get(row).map_or(row as u64, |f| f.number);
    for l in &result.loops.all {
        let edge = relative(&l.edge.later_from_earlier, &l.edge.covariance);
        let (later, earlier) = (number(l.edge.later), number(l.edge.earlier));
        let ClosedLoop { inliers, share, rms_px, weight, closed, .. } = l;
        writeln!(out, "{later},{earlier},{edge},{inliers},{share:.3},{rms_px:.3},{weight:.4},{closed}")?;
    }
    Ok(())
}

fn map_table(out: &mut impl Write, result: &RunResult, matches: &[MapMatch]) -> io::Result<()> {
    writeln!(out, "{MAP_COLUMNS}")?;
    for m in matches {
        let row = m.edge.frame;
        let number = result.frames.get(row).map_or(row as u64, |f| f.number);
        let edge = relative(&m.edge.camera_from_keyframe, &m.edge.covariance);
        let MapMatch { map_frame, inliers, share, rms_px, weight, holds, .. } = m;
        writeln!(out, "{number},{map_frame},{edge},{inliers},{share:.3},{rms_px:.3},{weight:.4},{holds}")?;
    }
    Ok(())
}

/// A relative pose and its standard deviations, as columns.
fn relative(pose: &Pose<Camera, Camera>, covariance: &Matrix6<f64>) -> String {
    let (t, q) = (pose.translation(), pose.rotation());
    let block = |at: usize| covariance.fixed_view::<3, 3>(at, at).trace().max(0.0).sqrt();
    format!(
        "{:.6},{:.6},{:.6},{:.9},{:.9},{:.9},{:.9},{:.5},{:.6}",
        t.x,
        t.y,
        t.z,
        q.i,
        q.j,
        q.k,
        q.w,
        block(3),
        block(0)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of a file in the table of its section of the book, in order.
    fn documented(book: &str, file: &str) -> Vec<String> {
        let section =
            book.split("\n## ").find(|s| s.lines().next().is_some_and(|l| l.contains(&format!("`{file}`"))));
        let rows = section.unwrap().lines().filter_map(|line| line.strip_prefix("| `")?.split_once('`'));
        rows.map(|(column, _)| column.to_owned()).collect()
    }

    #[test]
    fn the_book_lists_the_columns_in_their_order() {
        let book = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/outputs.md");
        let book = std::fs::read_to_string(book).unwrap();
        for (file, columns) in [("loops.csv", LOOP_COLUMNS), ("map_matches.csv", MAP_COLUMNS)] {
            assert_eq!(documented(&book, file), columns.split(',').collect::<Vec<_>>(), "{file}");
        }
    }
}
