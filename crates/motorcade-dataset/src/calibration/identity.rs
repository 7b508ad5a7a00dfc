//! A calibration as text, for fingerprints of inputs.

use motorcade_geometry::Distortion;

use super::Calibration;

impl Calibration {
    /// Every digit of every number. Radial-tangential calibrations without a stated view have the text they had before there
    /// were other lenses, and those of a global shutter that from before readout times, so that runs recorded then are recognised.
    pub fn identity(&self) -> String {
        let Self {
            dialect,
            fx,
            fy,
            cx,
            cy,
            size,
            distortion,
            view_deg,
            fps,
            height_m,
            readout_ms,
            focal_sigma,
            camera_from_cam0,
        } = self;
        let lens = match distortion {
            Distortion::RadialTangential(d) => format!(
                "Distortion {{ k1: {:?}, k2: {:?}, p1: {:?}, p2: {:?}, k3: {:?} }}",
                d.k1, d.k2, d.p1, d.p2, d.k3
            ),
            other => format!("{other:?}"),
        };
        let sigma = focal_sigma.map_or(String::new(), |sigma| format!(", focal_sigma: {sigma:?}"));
        let readout = if *readout_ms > 0.0 { format!(", readout_ms: {readout_ms:?}") } else { String::new() };
        let view = view_deg.map_or(String::new(), |view| format!(", view_deg: {view:?}"));
        format!(
            "Calibration {{ dialect: {dialect:?}, fx: {fx:?}, fy: {fy:?}, cx: {cx:?}, cy: {cy:?}, size: {size:?}, distortion: \
             {lens}{view}, fps: {fps:?}, height_m: {height_m:?}{readout}{sigma}, camera_from_cam0: {camera_from_cam0:?} }}"
        )
    }
}
