//! Size priors of vehicle classes.

use motorcade_perception::VehicleClass;
use motorcade_shape::{Dimensions, SizePrior};

/// The size prior of a class. Standard deviations span small to large models of the class. Cars and vans have
/// published references; the other classes are estimates from typical European models.
pub fn size_prior(class: VehicleClass) -> SizePrior {
    let prior = |mean: [f64; 3], sigma: [f64; 3]| SizePrior {
        mean: Dimensions { length_m: mean[0], width_m: mean[1], height_m: mean[2] },
        sigma: Dimensions { length_m: sigma[0], width_m: sigma[1], height_m: sigma[2] },
    };
    match class {
        // Length and width between the mean of KITTI's labelled cars (3.88 × 1.63 × 1.53 m; Qi et al., Frustum PointNets, CVPR 2018) and
        // that of the European models behind `motorcade-shape`'s prior (4.39 × 1.79 × 1.52 m), the height a centimetre below both; one sigma
        // reaches both.
        VehicleClass::Car => prior([4.2, 1.7, 1.51], [0.45, 0.10, 0.10]),
        // The mean of KITTI's labelled vans is 5.07 × 1.90 × 2.21 m (same source).
        VehicleClass::Van => prior([5.0, 1.9, 2.1], [0.6, 0.12, 0.25]),
        // From delivery lorries to articulated ones.
        VehicleClass::Truck => prior([7.0, 2.35, 2.9], [2.5, 0.25, 0.6]),
        // Detectors call minibuses buses too: 6 m long and 2.7 m high, against 12 m and 3.2 m.
        VehicleClass::Bus => prior([9.5, 2.4, 2.95], [3.0, 0.2, 0.4]),
        VehicleClass::Motorcycle => prior([2.1, 0.8, 1.6], [0.2, 0.1, 0.15]),
    }
}
