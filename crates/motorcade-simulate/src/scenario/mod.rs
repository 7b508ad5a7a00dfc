//! Named drives.

mod catalogue;
mod junctions;
mod parts;
mod roundabout;
mod seen_again;
mod traffic;

use crate::options::DetectorOptions;
use crate::plan::Plan;

/// A drive with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Short name.
    pub name: String,
    /// Description in one line.
    pub description: String,
    /// Its plan.
    pub plan: Plan,
    /// Errors of the detector.
    pub detector: DetectorOptions,
}

impl Scenario {
    /// The built-in scenario of this name.
    pub fn by_name(name: &str) -> Option<Self> {
        scenarios().into_iter().find(|scenario| scenario.name == name)
    }
}

/// All built-in scenarios, in a fixed order.
pub fn scenarios() -> Vec<Scenario> {
    catalogue::ENTRIES
        .iter()
        .map(|entry| Scenario {
            name: entry.name.to_owned(),
            description: entry.description.to_owned(),
            plan: (entry.plan)(),
            detector: catalogue::detector(entry.name),
        })
        .collect()
}
