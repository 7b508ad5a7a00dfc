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
    let mut o = OdometryOptions::default();
    let e = |k: &str| std::env::var(k).ok().and_then(|v| v.parse::<f64>().ok());
    if let Some(v) = e("FLOW") { o.policy.keyframe_flow_px = v; }
    if let Some(v) = e("KEPT") { o.policy.keyframe_kept = v; }
    if let Some(v) = e("CELL") { o.corners.per_cell = v as usize; }
    if let Some(v) = e("PAR") { o.window.least_parallax_rad = v.to_radians(); }
    if let Some(v) = e("FREE") { o.window.free_keyframes = v as usize; }
    if let Some(v) = e("FIX") { o.window.fixed_keyframes = v as usize; }
    if let Some(v) = e("KER") { o.window.bundle.kernel_px = v; }
    if let Some(v) = e("OUT") { o.window.outlier_px = v; }
    if let Some(v) = e("RET") { o.klt.max_return_px = v; }
    if let Some(v) = e("RMS") { o.klt.max_rms = v as f32; }
    if let Some(v) = e("ITER") { o.window.bundle.max_iterations = v as usize; }
    let mut odo = Odometry::new(camera, o);
    let mut times = vec![];
    let mut ro = motorcade_odometry::road::RoadOptions::default();
    if let Some(v) = e("BASE") { ro.baseline_heights = v; }
    if let Some(v) = e("FAR") { ro.far_heights = v; }
    if let Some(v) = e("HW") { ro.half_width_heights = v; }
    if let Some(v) = e("ROT") { ro.rotation_sigma_rad = v.to_radians(); }
    if let Some(v) = e("TILT") { ro.tilt_sigma_rad = v.to_radians(); }
    let mut ring: Vec<std::sync::Arc<motorcade_odometry::pyramid::Pyramid>> = vec![];
    let mut guess: Option<nalgebra::Vector3<f64>> = None;
    let mut log = std::fs::File::create(format!("{out}/road.txt")).unwrap();
    let mut road_ms = vec![];
    for n in first..=last {
        let img = image::open(format!("{dir}/{n:06}.jpg")).unwrap().to_luma8();
        let t = std::time::Instant::now();
        let mask = StaticMask { boxes: &boxes[n], ignore: None };
        let pyr = odo.process(&img, &mask);
        ring.push(pyr.clone());
        let t2 = std::time::Instant::now();
        let i = ring.len() - 1;
        let sofar = odo.so_far();
        if let Some(cur) = sofar.camera_from_world(i) {
            let height = guess.map_or(3.0, |g| 1.0 / g.norm());
            let pick = (i.saturating_sub(ro.oldest_frames)..i).rev().find_map(|k| {
                let rel = sofar.camera_from_world(k)? * cur.inverse();
                (rel.translation().norm() > ro.baseline_heights * height).then_some((k, rel))
            });
            if let Some((k, rel)) = pick {
                use motorcade_odometry::road::*;
                let mut view = RoadView { camera: &camera, current: &pyr, reference: &ring[k], reference_from_current: rel.cast(), guess: guess.unwrap_or(nalgebra::Vector3::new(0.0, 1.0/3.0, 0.0)) };
                if guess.is_none() { if let Some(m) = search_scale(&view, |p| mask.allows(p), &ro) { view.guess = m; } }
                let found = align_road(&view, |p| mask.allows(p), &ro);
                if let Some(p) = found {
                    let s = 1.65 * p.m.norm();
                    let n = p.m.normalize();
                    let sig = (n.transpose() * p.covariance * n)[0].sqrt() / p.m.norm();
                    writeln!(log, "{i} {k} {s} {sig} {} {} {} {:.3} {:.2} {}", (n.z / n.y).atan().to_degrees(), (n.x / n.y).atan().to_degrees(), p.pixels, p.agreement, p.sigma_grey, rel.translation().norm()).unwrap();
                    guess = Some(match guess { Some(g) => g + (p.m - g) * 0.3, None => p.m });
                } else { writeln!(log, "# {i} {k} none").unwrap(); }
            }
        }
        road_ms.push(t2.elapsed().as_secs_f64() * 1e3);
        if i >= 20 { ring[i - 20] = ring[i].clone(); }
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
