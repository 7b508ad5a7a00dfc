//! `loops.csv`: places seen again.

use std::io::{self, Write};
use std::path::Path;

use super::file;
use crate::error::Result;
use crate::result::RunResult;

/// Writes the table where there is a loop.
pub(super) fn write(folder: &Path, result: &RunResult) -> Result<()> {
    if result.loops.all.is_empty() {
        return Ok(());
    }
    file(&folder.join("loops.csv"), |out| table(out, result))
}

fn table(out: &mut impl Write, result: &RunResult) -> io::Result<()> {
    writeln!(
        out,
        "later_frame,earlier_frame,tx,ty,tz,qx,qy,qz,qw,sigma_m,sigma_rad,inliers,share,rms_px,weight,closed"
    )?;
    for l in &result.loops.all {
        let number = |row: usize| result.frames.get(row).map_or(row as u64, |f| f.number);
        let pose = &l.edge.later_from_earlier;
        let (t, q) = (pose.translation(), pose.rotation());
        let block = |at: usize| l.edge.covariance.fixed_view::<3, 3>(at, at).trace().max(0.0).sqrt();
        writeln!(
            out,
            "{},{},{:.6},{:.6},{:.6},{:.9},{:.9},{:.9},{:.9},{:.5},{:.6},{},{:.3},{:.3},{:.4},{}",
            number(l.edge.later),
            number(l.edge.earlier),
            t.x,
            t.y,
            t.z,
            q.i,
            q.j,
            q.k,
            q.w,
            block(3),
            block(0),
            l.inliers,
            l.share,
            l.rms_px,
            l.weight,
            l.closed
        )?;
    }
    Ok(())
}
