#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]
use motorcade_geometry::PinholeCamera;
use motorcade_odometry::{odometry::*, static_mask::*};
use std::io::Write;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (dir, first, last, dets, cams, out) =
        (&a[1], a[2].parse::<usize>().unwrap(), a[3].parse::<usize>().unwrap(), &a[4], &a[5], &a[6]);
    let c: Vec<f64> = cams.split(',').map(|v| v.parse().unwrap()).collect();
    let camera =
        PinholeCamera { fx: c[0], fy: c[1], cx: c[2], cy: c[3], width: c[4] as u32, height: c[5] as u32 };
    let mut boxes: Vec<Vec<Rectangle>> = vec![vec![]; 2000];
    if let Ok(t) = std::fs::read_to_string(dets) {
        for l in t.lines() {
            let p: Vec<&str> = l.split_whitespace().collect();
            if p[2] == "DontCare" {
                continue;
            }
            let v = |i: usize| p[i].parse::<f64>().unwrap();
            boxes[p[0].parse::<usize>().unwrap()].push(Rectangle { x1: v(6), y1: v(7), x2: v(8), y2: v(9) });
        }
    }
    let mut odo = Odometry::new(camera, OdometryOptions::default());
    let mut times = vec![];
    for n in first..=last {
        let img = image::open(format!("{dir}/{n:06}.jpg")).unwrap().to_luma8();
        let t = std::time::Instant::now();
        odo.process(&img, &StaticMask { boxes: &boxes[n], ignore: None });
        if std::env::var("V").is_ok() { let l = odo.landmarks(); let r = odo.so_far().frames.last().unwrap(); println!("{n} landmarks {} tracked {} with point {} inl {} rms {:.2} {:?}", l.len(), l.iter().filter(|l| l.pixel.is_some()).count(), l.iter().filter(|l| l.pixel.is_some() && l.point_in_world.is_some()).count(), r.inliers, r.rms_px, r.status); }
        times.push(t.elapsed().as_secs_f64() * 1e3);
    }
    let r = odo.finish();
    let mut f = std::fs::File::create(format!("{out}/ego.kitti.txt")).unwrap();
    for i in 0..r.frames.len() {
        let p = r.camera_from_world(i).map(|p| p.inverse()).unwrap_or_default();
        let (m, t) = (p.rotation_matrix(), p.translation());
        writeln!(
            f,
            "{} {} {} {} {} {} {} {} {} {} {} {}",
            m[(0, 0)],
            m[(0, 1)],
            m[(0, 2)],
            t[0],
            m[(1, 0)],
            m[(1, 1)],
            m[(1, 2)],
            t[1],
            m[(2, 0)],
            m[(2, 1)],
            m[(2, 2)],
            t[2]
        )
        .unwrap();
    }
    times.sort_by(f64::total_cmp);
    let inl: Vec<usize> = r.frames.iter().map(|f| f.inliers).collect();
    println!(
        "segments {} keyframes {} median ms {:.1} p95 {:.1} inliers min {:?} med {:?} bridged {}",
        r.keyframes.len(),
        r.keyframes.iter().map(Vec::len).sum::<usize>(),
        times[times.len() / 2],
        times[times.len() * 95 / 100],
        inl.iter().skip(5).min(),
        {
            let mut s = inl.clone();
            s.sort();
            s[s.len() / 2]
        },
        r.frames.iter().filter(|f| f.status == FrameStatus::Bridged).count()
    );
}
