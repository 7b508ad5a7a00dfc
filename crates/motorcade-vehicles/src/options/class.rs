//! Options of the choice of a vehicle's class.

/// Probabilities of the classes that are confused with each other, in the order car, van, truck, bus.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ClassOptions {
    /// Share of each class in the traffic: KITTI's labels have 28 742 cars, 2 914 vans and 1 094 trucks (buses are among `Misc`; the
    /// figure is a guess). A larger share needs less of votes and boxes to be chosen.
    pub shares: [f64; 4],
    /// Probability of a detector's class (column) for a vehicle's class (row). Our network calls 40 to 53 % of the lorries in its validation
    /// images lorries and 90 to 96 % of the cars cars; it knows no vans. A detector that knows vans finds most of them. Each number is that of
    /// the kind of detector that gives such votes, so that rows of vans, lorries and buses sum to more than one. Numbers nearer to those of the
    /// identity trust the detector more, size and ground contact less.
    pub confusion: [[f64; 4]; 4],
}

impl Default for ClassOptions {
    fn default() -> Self {
        Self {
            shares: [0.86, 0.09, 0.04, 0.01],
            confusion: [
                [0.94, 0.02, 0.05, 0.01],
                [0.60, 0.80, 0.30, 0.05],
                [0.40, 0.10, 0.50, 0.10],
                [0.15, 0.05, 0.25, 0.60],
            ],
        }
    }
}
