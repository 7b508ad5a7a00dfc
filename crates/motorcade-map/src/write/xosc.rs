//! OpenSCENARIO XML 1.2 (ASAM): a drive that a simulator replays.

use super::xml::Xml;
use crate::scenario::{Actor, Scenario};

/// Time that all trajectories share: seconds from the first frame.
const CLOCK: [(&str, &str); 3] = [("domainAbsoluteRelative", "absolute"), ("scale", "1"), ("offset", "0")];

/// The camera's own vehicle and every other one, each on its trajectory with the times of the frames, added when it is first seen and
/// deleted after it was last seen. Positions are east, north, up from the road under the first camera \[m\]; there is no road network.
pub fn xosc(scenario: &Scenario) -> String {
    let mut xml = Xml::new();
    xml.element("OpenSCENARIO", &[], |xml| {
        let header = [
            ("revMajor", "1"),
            ("revMinor", "2"),
            ("date", scenario.date.as_str()),
            (
                "description",
                "A drive estimated by motorcade; x east, y north, z up from the road under the first camera",
            ),
            ("author", concat!("motorcade ", env!("CARGO_PKG_VERSION"))),
        ];
        xml.empty("FileHeader", &header);
        xml.empty("CatalogLocations", &[]);
        xml.empty("RoadNetwork", &[]);
        xml.element("Entities", &[], |xml| scenario.actors.iter().for_each(|actor| entity(xml, actor)));
        xml.element("Storyboard", &[], |xml| storyboard(xml, scenario));
    });
    xml.finish()
}

fn entity(xml: &mut Xml, actor: &Actor) {
    xml.element("ScenarioObject", &[("name", &actor.name)], |xml| {
        let vehicle = [("name", actor.name.as_str()), ("vehicleCategory", actor.category)];
        xml.element("Vehicle", &vehicle, |xml| {
            let [length, width, height] = actor.size_m.map(number);
            xml.element("BoundingBox", &[], |xml| {
                let centre = [("x", number(actor.centre_x_m())), ("z", number(0.5 * actor.size_m[2]))];
                xml.empty("Center", &[("x", &centre[0].1), ("y", "0"), ("z", &centre[1].1)]);
                xml.empty("Dimensions", &[("width", &width), ("length", &length), ("height", &height)]);
            });
            xml.empty(
                "Performance",
                &[("maxSpeed", "70"), ("maxAcceleration", "10"), ("maxDeceleration", "10")],
            );
            xml.element("Axles", &[], |xml| {
                axle(xml, "FrontAxle", "0.5", actor.wheelbase_m, actor);
                axle(xml, "RearAxle", "0", 0.0, actor);
            });
            xml.empty("Properties", &[]);
        });
    });
}

fn axle(xml: &mut Xml, name: &str, steering: &str, x: f64, actor: &Actor) {
    let wheel = actor.wheel_m();
    let (x, z, track) = (number(x), number(0.5 * wheel), number(0.85 * actor.size_m[1]));
    let attributes = [
        ("maxSteering", steering),
        ("wheelDiameter", &number(wheel)),
        ("trackWidth", &track),
        ("positionX", &x),
        ("positionZ", &z),
    ];
    xml.empty(name, &attributes);
}

fn storyboard(xml: &mut Xml, scenario: &Scenario) {
    xml.element("Init", &[], |xml| {
        xml.element("Actions", &[], |xml| {
            for actor in scenario.actors.iter().filter(|a| a.starts_s() <= 0.0) {
                xml.element("Private", &[("entityRef", &actor.name)], |xml| {
                    xml.element("PrivateAction", &[], |xml| {
                        xml.element("TeleportAction", &[], |xml| position(xml, actor, 0));
                    });
                });
            }
        });
    });
    xml.element("Story", &[("name", "drive")], |xml| {
        for actor in &scenario.actors {
            xml.element("Act", &[("name", &format!("{} act", actor.name))], |xml| {
                group(xml, actor, scenario.end_s);
                xml.element("StartTrigger", &[], |xml| at_time(xml, "start", 0.0));
            });
        }
    });
    xml.element("StopTrigger", &[], |xml| at_time(xml, "end of the drive", scenario.end_s));
}

/// Everything one vehicle does.
fn group(xml: &mut Xml, actor: &Actor, end_s: f64) {
    let group = [("name", format!("{} group", actor.name)), ("maneuver", format!("{} maneuver", actor.name))];
    xml.element("ManeuverGroup", &[("maximumExecutionCount", "1"), ("name", &group[0].1)], |xml| {
        xml.element("Actors", &[("selectTriggeringEntities", "false")], |xml| {
            xml.empty("EntityRef", &[("entityRef", &actor.name)]);
        });
        xml.element("Maneuver", &[("name", &group[1].1)], |xml| {
            if actor.starts_s() > 0.0 {
                let add = |xml: &mut Xml| {
                    xml.element("AddEntityAction", &[], |xml| position(xml, actor, 0));
                };
                event(xml, actor, "appears", actor.starts_s(), |xml| of_entity(xml, actor, add));
            }
            if actor.poses.len() > 1 {
                event(xml, actor, "drives", actor.starts_s(), |xml| follow(xml, actor));
            }
            if actor.ends_s() < end_s {
                let delete = |xml: &mut Xml| xml.empty("DeleteEntityAction", &[]);
                event(xml, actor, "leaves", actor.ends_s(), |xml| of_entity(xml, actor, delete));
            }
        });
    });
}

fn event(xml: &mut Xml, actor: &Actor, what: &str, time_s: f64, action: impl FnOnce(&mut Xml)) {
    let name = format!("{} {what}", actor.name);
    xml.element("Event", &[("name", &name), ("priority", "parallel")], |xml| {
        xml.element("Action", &[("name", &name)], action);
        xml.element("StartTrigger", &[], |xml| at_time(xml, &name, time_s));
    });
}

fn of_entity(xml: &mut Xml, actor: &Actor, action: impl FnOnce(&mut Xml)) {
    xml.element("GlobalAction", &[], |xml| {
        xml.element("EntityAction", &[("entityRef", &actor.name)], action);
    });
}

fn follow(xml: &mut Xml, actor: &Actor) {
    let path = ["PrivateAction", "RoutingAction", "FollowTrajectoryAction"];
    xml.nested(&path, |xml| {
        xml.element("TimeReference", &[], |xml| xml.empty("Timing", &CLOCK));
        xml.empty("TrajectoryFollowingMode", &[("followingMode", "position")]);
        xml.element("TrajectoryRef", &[], |xml| {
            let name = format!("{} trajectory", actor.name);
            xml.element("Trajectory", &[("name", &name), ("closed", "false")], |xml| {
                xml.nested(&["Shape", "Polyline"], |xml| {
                    for (k, pose) in actor.poses.iter().enumerate() {
                        xml.element("Vertex", &[("time", &number(pose.time_s))], |xml| {
                            position(xml, actor, k)
                        });
                    }
                });
            });
        });
    });
}

/// The rear axle on the road, where OpenSCENARIO has a vehicle's origin.
fn position(xml: &mut Xml, actor: &Actor, pose: usize) {
    let Some(at) = actor.poses.get(pose) else { return };
    xml.element("Position", &[], |xml| {
        let [x, y, z] = [at.rear_axle_m.x, at.rear_axle_m.y, at.rear_axle_m.z].map(number);
        let [h, p, r] = at.heading_pitch_roll_rad.map(|angle| fixed(angle, 5));
        xml.empty("WorldPosition", &[("x", &x), ("y", &y), ("z", &z), ("h", &h), ("p", &p), ("r", &r)]);
    });
}

fn at_time(xml: &mut Xml, name: &str, time_s: f64) {
    xml.nested(&["ConditionGroup"], |xml| {
        xml.element("Condition", &[("name", name), ("delay", "0"), ("conditionEdge", "none")], |xml| {
            xml.element("ByValueCondition", &[], |xml| {
                let condition = [("value", number(time_s)), ("rule", "greaterOrEqual".to_owned())];
                xml.empty("SimulationTimeCondition", &condition.each_ref().map(|(k, v)| (*k, v.as_str())));
            });
        });
    });
}

fn number(value: f64) -> String {
    fixed(value, 3)
}

/// A number of so many decimals; what rounds to zero has no sign.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|b| b == b'0' || b == b'.') => zero.to_owned(),
        _ => text,
    }
}
