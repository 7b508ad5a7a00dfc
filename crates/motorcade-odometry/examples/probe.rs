#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]
use motorcade_geometry::PinholeCamera;
use motorcade_odometry::*;
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
    if let Some(v) = e("FLOW") {
        o.policy.keyframe_flow_px = v;
    }
    if let Some(v) = e("KEPT") {
        o.policy.keyframe_kept = v;
    }
    if let Some(v) = e("CELL") {
        o.corners.per_cell = v as usize;
    }
    if let Some(v) = e("PAR") {
        o.window.least_parallax_rad = v.to_radians();
    }
    if let Some(v) = e("FREE") {
        o.window.free_keyframes = v as usize;
    }
    if let Some(v) = e("FIX") {
        o.window.fixed_keyframes = v as usize;
    }
    if let Some(v) = e("KER") {
        o.window.bundle.kernel_px = v;
    }
    if let Some(v) = e("OUT") {
        o.window.outlier_px = v;
    }
    if let Some(v) = e("RET") {
        o.klt.max_return_px = v;
    }
    if let Some(v) = e("RMS") {
        o.klt.max_rms = v as f32;
    }
    if let Some(v) = e("ITER") {
        o.window.bundle.max_iterations = v as usize;
    }
    let mut ro = RoadOptions::default();
    if let Some(v) = e("BASE") {
        ro.baseline_heights = v;
    }
    if let Some(v) = e("FAR") {
        ro.far_heights = v;
    }
    if let Some(v) = e("HW") {
        ro.half_width_heights = v;
    }
    if let Some(v) = e("ROT") {
        ro.rotation_sigma_rad = v.to_radians();
    }
    if let Some(v) = e("TILT") {
        ro.tilt_sigma_rad = v.to_radians();
    }
    let mut odo = Odometry::new(camera, o);
    let mut road = RoadTracker::new(camera, ro);
    let (mut times, mut road_ms) = (vec![], vec![]);
    for n in first..=last {
        let img = image::open(format!("{dir}/{n:06}.jpg")).unwrap().to_luma8();
        let mask = StaticMask { boxes: &boxes[n], ignore: None };
        let t = std::time::Instant::now();
        let pyr = odo.process(&img, &mask);
        times.push(t.elapsed().as_secs_f64() * 1e3);
        let t = std::time::Instant::now();
        let i = n - first;
        let s = odo.so_far();
        road.process(i, s.frames[i].segment, &pyr, |k| s.camera_from_world(k), |p| mask.allows(p));
        road_ms.push(t.elapsed().as_secs_f64() * 1e3);
    }
    let r = odo.finish();
    let ego = EgoTrajectory::new(&r, road.measurements(), 1.65);
    let mut f = std::fs::File::create(format!("{out}/ego.kitti.txt")).unwrap();
    for p in &ego.frames {
        let (m, t) = (p.world_from_camera.rotation_matrix(), p.world_from_camera.translation());
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
    road_ms.sort_by(f64::total_cmp);
    let mut inl: Vec<usize> = r.frames.iter().map(|f| f.inliers).collect();
    inl.sort();
    println!(
        "segments {} kf {} ms {:.1} p95 {:.1} road {:.1}/{:.1} inl {} bridged {} meas {} {:?}",
        r.keyframes.len(),
        r.keyframes.iter().map(Vec::len).sum::<usize>(),
        times[times.len() / 2],
        times[times.len() * 95 / 100],
        road_ms[times.len() / 2],
        road_ms[times.len() * 95 / 100],
        inl[inl.len() / 2],
        r.frames.iter().filter(|f| f.status == FrameStatus::Bridged).count(),
        road.measurements().len(),
        ego.noise
    );
}
