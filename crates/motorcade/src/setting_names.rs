//! Names of settings that earlier versions had: most of them stood one level higher than now, not below `advanced`.

use toml::{Table, Value};

use crate::error::{Error, Result};

/// Section that holds what users rarely change.
pub(crate) const ADVANCED: &str = "advanced";

/// The settings that were given under the names that `known`, all settings by section, has for them. A key that its section does not know and the
/// `advanced` of that section does is taken there; `advanced` within what is below `advanced` already is taken for the section around it. Other
/// keys stay as they are.
///
/// # Errors
/// A setting under both names.
pub(crate) fn current(given: &Table, known: &Table, origin: &str) -> Result<Table> {
    let mut names = Names { origin, found: Table::new() };
    names.collect(given, known, &[])?;
    Ok(names.found)
}

struct Names<'a> {
    origin: &'a str,
    found: Table,
}

impl Names<'_> {
    fn collect(&mut self, given: &Table, known: &Table, path: &[&str]) -> Result<()> {
        let advanced = known.get(ADVANCED).and_then(Value::as_table);
        for (key, value) in given {
            let here = [path, &[key]].concat();
            let (full, setting) = match (known.get(key), advanced.and_then(|a| a.get(key))) {
                (Some(setting), _) => (here, Some(setting)),
                (None, Some(setting)) => ([path, &[ADVANCED, key]].concat(), Some(setting)),
                (None, None) => (here, None),
            };
            match (setting, value) {
                (Some(Value::Table(section)), Value::Table(inner)) => self.collect(inner, section, &full)?,
                (None, Value::Table(inner)) if merged_into(path, key) => self.collect(inner, known, path)?,
                _ => self.put(&full, value)?,
            }
        }
        Ok(())
    }

    fn put(&mut self, full: &[&str], value: &Value) -> Result<()> {
        let Some((key, sections)) = full.split_last() else { return Ok(()) };
        let mut table = Some(&mut self.found);
        for section in sections {
            let inner = table.map(|t| t.entry(*section).or_insert_with(|| Value::Table(Table::new())));
            table = inner.and_then(Value::as_table_mut);
        }
        match table {
            Some(table) if !table.contains_key(*key) => {
                table.insert((*key).to_owned(), value.clone());
                Ok(())
            }
            _ => {
                let name = full.join(".");
                Err(Error::Config(format!("{}: {name} is given under two of its names", self.origin)))
            }
        }
    }
}

/// True for an `advanced` of a section that is below one itself.
fn merged_into(path: &[&str], key: &str) -> bool {
    key == ADVANCED && path.contains(&ADVANCED) && path.last() != Some(&ADVANCED)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Config, Preset};

    fn settings() -> Table {
        Table::try_from(Config::preset(Preset::Paper)).unwrap()
    }

    /// All settings by their full names.
    fn names(table: &Table, path: &str, found: &mut Vec<String>) {
        for (key, value) in table {
            let full = format!("{path}.{key}");
            match value {
                Value::Table(inner) => names(inner, &full, found),
                _ => found.push(full),
            }
        }
    }

    /// The table with all that is below `advanced` one level higher.
    fn raised(table: Table) -> Table {
        let mut flat = Table::new();
        for (key, value) in table {
            match value {
                Value::Table(inner) if key == ADVANCED => flat.extend(raised(inner)),
                Value::Table(inner) => drop(flat.insert(key, Value::Table(raised(inner)))),
                value => drop(flat.insert(key, value)),
            }
        }
        flat
    }

    #[test]
    fn few_settings_are_for_users_and_names_say_advanced_once() {
        let mut all = Vec::new();
        names(&settings(), "", &mut all);
        let levels = |name: &String| name.split('.').filter(|part| *part == ADVANCED).count();
        let for_users = all.iter().filter(|name| levels(name) == 0).count();
        assert!(all.len() > 500 && for_users <= 80, "{for_users} of {}", all.len());
        let twice: Vec<&String> = all.iter().filter(|name| levels(name) > 1).collect();
        assert!(twice.is_empty(), "{twice:?}");
    }

    #[test]
    fn no_name_means_two_settings() {
        fn check(table: &Table, path: &str) {
            let advanced = table.get(ADVANCED).and_then(Value::as_table);
            for (key, value) in table {
                assert!(
                    advanced.is_none_or(|a| !a.contains_key(key)),
                    "{path}.{key} and {path}.advanced.{key}"
                );
                if let Value::Table(inner) = value {
                    check(inner, &format!("{path}.{key}"));
                }
            }
        }
        check(&settings(), "");
    }

    #[test]
    fn a_setting_is_found_by_its_name_without_advanced() {
        let text = toml::to_string(&raised(settings())).unwrap();
        assert!(!text.contains(ADVANCED));
        assert_eq!(Config::default().overlay(&text, "my.toml").unwrap(), Config::preset(Preset::Paper));
        let record = serde_json::json!({ "configuration": raised(settings()) }).to_string();
        assert_eq!(Config::default().overlay(&record, "run.json").unwrap(), Config::preset(Preset::Paper));
    }

    #[test]
    fn names_of_earlier_versions_are_read() {
        let text = "[odometry.policy]\ngive_up_s = 1.0\n[odometry.policy.advanced]\nmedian_depth = 9\n[graph]\nkernel_scale = 2";
        let config = Config::default().overlay(text, "my.toml").unwrap();
        let policy = config.odometry.advanced.policy;
        assert_eq!((policy.give_up_s, policy.median_depth), (1.0, 9.0));
        assert_eq!(config.graph.advanced.kernel_scale, 2.0);
        let config = config.set("vehicles.advanced.keypoints.fit.advanced.step_m=0.25").unwrap();
        assert_eq!(config.vehicles.advanced.keypoints.fit.advanced.step_m, 0.25);
        let config = config.set("checks.pictures.columns=30").unwrap();
        assert_eq!(config.checks.advanced.pictures.columns, 30);
        // The later one of two that were set one after another counts, as always.
        let config = config.set("checks.advanced.pictures.columns=31").unwrap();
        assert_eq!(config.checks.advanced.pictures.columns, 31);
    }

    #[test]
    fn names_of_none_or_of_both_levels_are_refused() {
        let refused = |text: &str| Config::default().overlay(text, "my.toml").unwrap_err().to_string();
        let both = refused("[scale.unit]\nleast_s = 1.0\n[scale.advanced.unit]\nleast_s = 2.0");
        assert!(both.contains("scale.advanced.unit.least_s is given under two of its names"), "{both}");
        let both = refused("[places]\nsearch = 1\n[places.advanced.search]\ntables = 4");
        assert!(both.contains("places.advanced.search"), "{both}");
        let neither = refused("[odometry.policy]\nkeyframe_flow = 1.0");
        assert!(neither.contains("did you mean `keyframe_flow_rad`?"), "{neither}");
        let section = refused("[odometry.polcy]\ngive_up_s = 1.0");
        assert!(section.contains("did you mean `advanced.policy`?"), "{section}");
        let higher = refused("[graph.advanced]\nenabled = false");
        assert!(higher.contains("unknown key `enabled` in `graph.advanced`"), "{higher}");
        let deeper = refused("[vehicles.advanced.advanced]\ncorrelation_time_s = 1.0");
        assert!(deeper.contains("unknown key `advanced` in `vehicles.advanced`"), "{deeper}");
    }
}
