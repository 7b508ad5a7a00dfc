//! Reading of maps.

use motorcade_geometry::{PinholeCamera, Pose};
use nalgebra::{Matrix6, Quaternion, UnitQuaternion, Vector3};

use super::bytes::{Reader, checksum, upper_triangle};
use super::error::MapError;
use super::{MAGIC, PlaceMap, VERSION};
use crate::features::{Descriptor, Feature};
use crate::hidden::HiddenParts;
use crate::keyframe::{Landmark, PlacedKeyframe};

/// Bytes of a landmark, and of a keyframe without any.
const LANDMARK_BYTES: usize = 58;
const KEYFRAME_BYTES: usize = 248;

impl PlaceMap {
    /// Reads a map.
    ///
    /// # Errors
    /// Bytes that are no map, of another version, damaged, or with values that no map has.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MapError> {
        let body = bytes.strip_prefix(MAGIC).ok_or(MapError::NoMap("MCDRMAP"))?;
        let found = Reader(body).u32()?;
        if found != VERSION {
            return Err(MapError::Version { found, known: VERSION });
        }
        let ends = || MapError::Damaged("it ends early".into());
        let (content, sum) = bytes.split_last_chunk::<8>().ok_or_else(ends)?;
        if checksum(content) != u64::from_le_bytes(*sum) {
            return Err(MapError::Damaged("its checksum is another one".into()));
        }
        let mut reader = Reader(content.get(MAGIC.len() + 4..).ok_or_else(ends)?);
        let r = &mut reader;
        let camera = PinholeCamera {
            fx: r.f64()?,
            fy: r.f64()?,
            cx: r.f64()?,
            cy: r.f64()?,
            width: r.u32()?,
            height: r.u32()?,
        };
        camera.validate().map_err(|e| MapError::Damaged(e.to_string()))?;
        let height_m = r.f64()?;
        let count = r.count(KEYFRAME_BYTES)?;
        let keyframes = (0..count).map(|_| keyframe(r)).collect::<Result<_, _>>()?;
        match reader.0 {
            [] => Ok(Self { camera, height_m, keyframes }),
            rest => Err(MapError::Damaged(format!("{} bytes follow its end", rest.len()))),
        }
    }
}

fn keyframe(r: &mut Reader<'_>) -> Result<PlacedKeyframe, MapError> {
    let (frame, segment) = (r.u64()? as usize, r.u32()? as usize);
    let [i, j, k, w] = [r.f64()?, r.f64()?, r.f64()?, r.f64()?];
    let quaternion = Quaternion::new(w, i, j, k);
    if (quaternion.norm() - 1.0).abs() > 1e-3 {
        return Err(MapError::Damaged("a rotation is none".into()));
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    let world_from_camera = Pose::from_parts(rotation, Vector3::new(r.f64()?, r.f64()?, r.f64()?));
    let way_m = r.f64()?;
    let covariance = covariance(r)?;
    let count = r.count(LANDMARK_BYTES)?;
    let (mut features, mut landmarks) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for feature in 0..count as u32 {
        let descriptor = Descriptor([r.u64()?, r.u64()?, r.u64()?, r.u64()?]);
        let pixel = [r.f32()?, r.f32()?];
        features.push(Feature { descriptor, pixel, level: r.u8()?, turn: r.u8()? });
        let point_in_camera = [r.f32()?, r.f32()?, r.f32()?];
        landmarks.push(Landmark { feature, point_in_camera, depth_sigma: r.f32()? });
    }
    let hidden = HiddenParts::default();
    Ok(PlacedKeyframe { frame, segment, world_from_camera, covariance, way_m, features, landmarks, hidden })
}

/// A covariance, refused where it is none.
fn covariance(r: &mut Reader<'_>) -> Result<Matrix6<f64>, MapError> {
    let mut covariance = Matrix6::zeros();
    for (row, column) in upper_triangle() {
        let value = r.f64()?;
        (covariance[(row, column)], covariance[(column, row)]) = (value, value);
    }
    // Those of exact poses are singular.
    let least = 1e-9 * (1.0 + covariance.trace().abs());
    let positive = (covariance + Matrix6::identity() * least).cholesky().is_some();
    if positive { Ok(covariance) } else { Err(MapError::Damaged("a covariance is none".into())) }
}
