//! The variants that are compared.

use motorcade::Preset;
use motorcade_geometry::{Camera, Pose, World};

/// One configuration.
pub struct Variant {
    /// Name in the table.
    pub name: String,
    /// Preset it starts from.
    pub preset: Preset,
    /// Settings it changes.
    pub set: Vec<String>,
}

pub(super) fn variant(name: impl Into<String>, preset: Preset, set: &[&str]) -> Variant {
    Variant { name: name.into(), preset, set: set.iter().map(|s| (*s).to_owned()).collect() }
}

/// Ways to the camera's metric trajectory.
pub fn odometry() -> Vec<Variant> {
    let mut out = vec![variant("default", Preset::Default, &[])];
    for t in [12, 15, 18, 20] {
        let farthest = format!("scale.farthest_m={t}");
        let paper = |name: &str, set: &[&str]| {
            let set = [set, &[farthest.as_str(), "graph.enabled=false"]].concat();
            variant(format!("{name}, T = {t} m"), Preset::Paper, &set)
        };
        out.push(paper("paper: mean of closed forms", &[]));
        out.push(paper("median of closed forms", &["scale.average=median"]));
        out.push(paper("median, smoothed", &["scale.average=median", "scale.smoothed=true"]));
    }
    let rest: [(&str, &[&str]); 11] = [
        (
            "road aligned, normal (0, -1, 0), each frame alone",
            &["road.free_normal=false", "scale.smoothed=false"],
        ),
        ("road aligned, normal (0, -1, 0), smoothed", &["road.free_normal=false"]),
        ("road aligned, normal free, each frame alone", &["scale.smoothed=false"]),
        ("default without the road inside the adjustment", &["odometry.advanced.window.road_scale=false"]),
        ("default without points on the road plane", &["odometry.advanced.window.road_plane=false"]),
        ("default, vehicles of the earlier picture taken for road", &["road.advanced.both_pictures=false"]),
        ("default without a road mask", &["run.road_mask=false"]),
        ("default, all vehicles masked", &["run.vehicle_mask=all"]),
        ("default, no vehicle masked", &["run.vehicle_mask=none"]),
        ("default without the multi-object graph", &["graph.enabled=false"]),
        ("default, a keyframe every 1.2°", &["odometry.advanced.policy.keyframe_flow_rad=0.0209"]),
    ];
    out.extend(rest.map(|(name, set)| variant(name, Preset::Default, set)));
    out
}

/// Edges, weights, kernels.
pub fn graph() -> Vec<Variant> {
    let mut out = edges_off(Preset::Default, "default");
    out.extend([
        variant("default, no graph", Preset::Default, &["graph.enabled=false"]),
        variant("default, camera held", Preset::Default, &["graph.camera=held"]),
        variant("default, lengths held", Preset::Default, &["graph.camera=lengths_held"]),
        variant("default, camera free", Preset::Default, &["graph.camera=free"]),
        variant("default, sizes not shared", Preset::Default, &["graph.advanced.shared_size=false"]),
        variant("default, started by the front end", Preset::Default, &["graph.advanced.medoid_start=false"]),
        variant("default, covariances as measured", Preset::Default, &["graph.advanced.variance_rounds=0"]),
    ]);
    for share in ["1.0", "2.0", "8.0"] {
        let set = format!("graph.correlation_time_s={share}");
        let name = format!("default, correlation_time_s = {share}");
        out.push(variant(name, Preset::Default, &[&set]));
    }
    out.extend(edges_off(Preset::Paper, "paper"));
    out.push(variant("paper, no graph", Preset::Paper, &["graph.enabled=false"]));
    for (key, values) in [
        ("graph.lambda_camera", ["1e2", "1e6"]),
        ("graph.lambda_trusted", ["1e1", "1e3"]),
        ("graph.lambda_doubted", ["0.1", "10.0"]),
    ] {
        for value in values {
            let name = format!("paper, {} = {value}", key.trim_start_matches("graph."));
            out.push(variant(name, Preset::Paper, &[&format!("{key}={value}")]));
        }
    }
    for limit in [15, 25, 35, 60] {
        let set = format!("graph.advanced.near_limit_m={limit}");
        out.push(variant(format!("paper, near limit {limit} m"), Preset::Paper, &[&set]));
    }
    for kernel in ["none", "huber", "geman_mc_clure", "dcs"] {
        let set = format!("graph.advanced.kernel={kernel}");
        out.push(variant(format!("default, kernel {kernel}"), Preset::Default, &[&set]));
    }
    for scale in ["3.5", "10.0"] {
        let set = format!("graph.advanced.kernel_scale={scale}");
        out.push(variant(format!("default, Cauchy at {scale} σ"), Preset::Default, &[&set]));
    }
    out
}

/// The paper's Table 1: farthest road point of its scale.
pub fn paper_limits() -> Vec<Variant> {
    let of = |t: u32| {
        let farthest = format!("scale.farthest_m={t}");
        variant(format!("paper, T = {t} m"), Preset::Paper, &[&farthest])
    };
    [12, 15, 18, 20].map(of).into()
}

/// The paper's Table 2: its method, the baseline on the same measurements, and the default.
pub fn methods() -> [Variant; 3] {
    [
        variant("paper", Preset::Paper, &[]),
        variant("baseline: relative scale by motion", Preset::Paper, &["graph.enabled=false"]),
        variant("default", Preset::Default, &[]),
    ]
}

/// The paper's Table 3.
pub fn paper_edges() -> Vec<Variant> {
    edges_off(Preset::Paper, "paper")
}

/// A preset, and classes of its edges off one by one and in pairs.
fn edges_off(preset: Preset, name: &str) -> Vec<Variant> {
    let edges = ["camera_camera", "camera_vehicle", "vehicle_vehicle"];
    let off = |k: usize| format!("graph.{}=false", edges[k]);
    let mut out = vec![variant(name, preset, &[])];
    for k in 0..3 {
        out.push(variant(format!("{name} without {}", edges[k]), preset, &[&off(k)]));
    }
    for k in 0..3 {
        let others = [off((k + 1) % 3), off((k + 2) % 3)];
        out.push(variant(format!("{name}, {} only", edges[k]), preset, &[&others[0], &others[1]]));
    }
    out
}

/// A trajectory with the true distance over ±5 frames put into its steps.
pub fn with_true_scale(
    poses: &[Pose<World, Camera>],
    truth: &[Pose<World, Camera>],
) -> Vec<Pose<World, Camera>> {
    const HALF_WINDOW: usize = 5;
    let length = |p: &[Pose<World, Camera>], k: usize| {
        let range = k.saturating_sub(HALF_WINDOW)..(k + HALF_WINDOW).min(p.len() - 1);
        range.map(|i| (p[i + 1].translation() - p[i].translation()).norm()).sum::<f64>()
    };
    let mut out: Vec<Pose<World, Camera>> = poses.first().copied().into_iter().collect();
    for k in 1..poses.len() {
        let step: Pose<Camera, Camera> = poses[k - 1].inverse() * poses[k];
        let own = length(poses, k - 1);
        let ratio = if own > 1e-6 { length(truth, k - 1) / own } else { 1.0 };
        out.push(out[k - 1] * step.scaled(ratio));
    }
    out
}
