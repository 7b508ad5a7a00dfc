//! Kinds, units and descriptions of the columns of a run's tables.

/// Kind of the values of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Numbers.
    Number,
    /// Whole numbers from 0.
    Whole,
    /// Text.
    Text,
    /// `true` and `false`.
    Flag,
}

/// What is known of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Described {
    pub kind: Kind,
    pub unit: &'static str,
    pub description: &'static str,
}

/// Name, kind and description of the columns of the tables. Those of one name mean the same in both.
const COLUMNS: [(&str, Kind, &str); 43] = [
    ("drive_id", Kind::Text, "Identity of the drive"),
    ("timestamp_ns", Kind::Whole, "Time of the frame on the clock of the input"),
    ("frame", Kind::Whole, "Number of the frame in the input"),
    ("time_s", Kind::Number, "Time of the frame on the clock of the input, rounded to microseconds"),
    ("status", Kind::Text, "Origin of the pose: tracked, standstill, bridged (interpolated), filled_in"),
    ("inliers", Kind::Whole, "Tracked points that agree with the pose"),
    ("speed_mps", Kind::Number, "Speed; of the camera over the interval before the frame"),
    ("scale_m_per_unit", Kind::Number, "Metres per length unit of the odometry"),
    ("scale_sigma_rel", Kind::Number, "Relative standard deviation of the metric scale"),
    ("scale_measured", Kind::Flag, "True where the road was measured in this frame"),
    ("road_pitch_rad", Kind::Number, "Pitch of the road in the camera frame"),
    ("road_roll_rad", Kind::Number, "Roll of the road in the camera frame"),
    ("sigma_x_m", Kind::Number, "Standard deviation of the camera's position along its x axis"),
    ("sigma_y_m", Kind::Number, "Standard deviation of the camera's position along its y axis"),
    ("sigma_z_m", Kind::Number, "Standard deviation of the camera's position along its z axis"),
    ("sigma_yaw_rad", Kind::Number, "Standard deviation of the camera's rotation about its y axis"),
    ("id", Kind::Whole, "Identity of the vehicle in the drive"),
    ("class", Kind::Text, "Class of the vehicle"),
    ("x_m", Kind::Number, "Position in the world, x"),
    ("y_m", Kind::Number, "Position in the world, y"),
    ("z_m", Kind::Number, "Position in the world, z"),
    ("qx", Kind::Number, "Rotation to the world, unit quaternion, x"),
    ("qy", Kind::Number, "Rotation to the world, unit quaternion, y"),
    ("qz", Kind::Number, "Rotation to the world, unit quaternion, z"),
    ("qw", Kind::Number, "Rotation to the world, unit quaternion, w"),
    ("length_m", Kind::Number, "Length of the vehicle"),
    ("width_m", Kind::Number, "Width of the vehicle"),
    ("height_m", Kind::Number, "Height of the vehicle"),
    ("sigma_length_m", Kind::Number, "Standard deviation of the length"),
    ("sigma_width_m", Kind::Number, "Standard deviation of the width"),
    ("sigma_height_m", Kind::Number, "Standard deviation of the height"),
    ("yaw_rate_radps", Kind::Number, "Rate of turn about the vertical, left positive"),
    (
        "sigma_forward_m",
        Kind::Number,
        "Standard deviation of the position in the world along the vehicle's x axis",
    ),
    (
        "sigma_left_m",
        Kind::Number,
        "Standard deviation of the position in the world along the vehicle's y axis",
    ),
    (
        "sigma_up_m",
        Kind::Number,
        "Standard deviation of the position in the world along the vehicle's z axis",
    ),
    ("sigma_heading_rad", Kind::Number, "Standard deviation of the heading"),
    ("sigma_speed_mps", Kind::Number, "Standard deviation of the speed"),
    ("source", Kind::Text, "Origin of the state: box, keypoints, given (external), predicted (not seen)"),
    ("p_moving", Kind::Number, "Probability that the vehicle moves during its track"),
    ("score", Kind::Number, "Score of the detection"),
    (
        "sigma_relative_forward_m",
        Kind::Number,
        "Standard deviation of the position relative to the camera, vehicle's x axis",
    ),
    (
        "sigma_relative_left_m",
        Kind::Number,
        "Standard deviation of the position relative to the camera, vehicle's y axis",
    ),
    (
        "sigma_relative_up_m",
        Kind::Number,
        "Standard deviation of the position relative to the camera, vehicle's z axis",
    ),
];

/// Units by the end of a name, the longer ones first.
const UNITS: [(&str, &str); 10] = [
    ("_m_per_unit", "m"),
    ("_mps2", "m/s^2"),
    ("_radps", "rad/s"),
    ("_mps", "m/s"),
    ("_rad", "rad"),
    ("_rel", "1"),
    ("_px", "px"),
    ("_ns", "ns"),
    ("_m", "m"),
    ("_s", "s"),
];

/// What is known of the column of this name. Others are numbers where their name ends in a unit, else text: the type never depends
/// on the values, so that files of several runs fit together.
pub(super) fn described(name: &str) -> Described {
    let unit = UNITS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| *unit);
    let known = COLUMNS.iter().find(|(known, ..)| *known == name);
    let (kind, description) = match known {
        Some((_, kind, description)) => (*kind, *description),
        None if unit.is_some() => (Kind::Number, ""),
        None => (Kind::Text, ""),
    };
    Described { kind, unit: unit.unwrap_or_default(), description }
}
