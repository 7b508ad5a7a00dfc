//! Tables 1 to 3 of the paper (Nair et al., *Multi-object Monocular SLAM for Dynamic Environments*, IV 2020) on one drive.

use std::fmt::Write;

use motorcade::{FrontEndRecord, Progress, Settings, estimate_drive};

use super::baseline::{BaselineScale, with_relative_scales};
use super::relative_scale::Assumption;
use super::suites::{self, Variant};
use super::table::{self, cell};
use super::{Ablation, Row};
use crate::arguments::AblateArguments;

/// Output of the front end, and the settings it had.
type FrontEnd = (FrontEndRecord, Settings);

/// Rows of all tables.
#[derive(Default)]
struct Tables {
    /// Farthest road point of the scale.
    limits: Vec<Row>,
    /// The method, the baseline, and the default.
    methods: Vec<Row>,
    /// Scales of the baseline, of vehicles in the order of their tracks.
    scales: Vec<BaselineScale>,
    /// Classes of edges.
    edges: Vec<Row>,
}

/// Runs the suite, prints its tables and writes them.
pub fn paper(arguments: &AblateArguments) -> anyhow::Result<u8> {
    let mut ablation = Ablation::of(arguments)?;
    let mut tables = Tables::default();
    // Tables 2 and 3 take the first limit: one pass over the frames serves all their rows of the paper's method.
    let front_end = limits(&mut ablation, &mut tables)?;
    if let Some(front_end) = front_end {
        edges(&ablation, &front_end, &mut tables)?;
        methods(&mut ablation, &front_end, &mut tables)?;
    }
    ablation.write_tables(&tables.markdown(), &tables.csv())
}

/// Table 1; returns the front end of its first row.
fn limits(ablation: &mut Ablation<'_>, tables: &mut Tables) -> anyhow::Result<Option<FrontEnd>> {
    let mut first = None;
    for variant in suites::paper_limits() {
        let (record, settings) = ablation.front_end(&ablation.config(&variant)?)?;
        if record.interrupted {
            break;
        }
        tables.limits.push(estimated(ablation, &variant, (&record, &settings))?);
        first.get_or_insert((record, settings));
    }
    Ok(first)
}

/// Table 3.
fn edges(ablation: &Ablation<'_>, (record, base): &FrontEnd, tables: &mut Tables) -> anyhow::Result<()> {
    for variant in suites::paper_edges() {
        if Progress::cancelled(&ablation.reporter) {
            break;
        }
        let settings = Settings { config: ablation.config(&variant)?, ..base.clone() };
        tables.edges.push(estimated(ablation, &variant, (record, &settings))?);
    }
    Ok(())
}

/// Table 2. The baseline gets the camera and the sightings that the paper's graph gets.
fn methods(
    ablation: &mut Ablation<'_>,
    (record, base): &FrontEnd,
    tables: &mut Tables,
) -> anyhow::Result<()> {
    let [paper, baseline, default] = suites::methods();
    let settings = |variant: &Variant| -> anyhow::Result<Settings> {
        Ok(Settings { config: ablation.config(variant)?, ..base.clone() })
    };
    let (with_graph, without_graph) = (settings(&paper)?, settings(&baseline)?);
    tables.methods.push(estimated(ablation, &paper, (record, &with_graph))?);
    let mut result = estimate_drive(record.clone(), &without_graph, &ablation.reporter);
    tables.scales = with_relative_scales(&mut result);
    tables.methods.push(ablation.row(&baseline, &without_graph.config, &result)?);
    let (record, settings) = ablation.front_end(&ablation.config(&default)?)?;
    if !record.interrupted {
        tables.methods.push(estimated(ablation, &default, (&record, &settings))?);
    }
    Ok(())
}

fn estimated(
    ablation: &Ablation<'_>,
    variant: &Variant,
    (record, settings): (&FrontEndRecord, &Settings),
) -> anyhow::Result<Row> {
    let result = estimate_drive(record.clone(), settings, &ablation.reporter);
    ablation.row(variant, &settings.config, &result)
}

impl Tables {
    fn markdown(&self) -> String {
        let mut out = String::from("Table 1: farthest road point T of the scale\n\n");
        out.push_str(&table::graph(&self.limits));
        out.push_str("\nTable 2: methods\n\n");
        out.push_str(&table::graph(&self.methods));
        out.push_str("\nRelative scales of the baseline\n\n");
        out.push_str(&self.scales_of_labels());
        out.push_str("\nTable 3: classes of edges\n\n");
        out.push_str(&table::graph(&self.edges));
        out
    }

    fn csv(&self) -> String {
        table::csv_of_tables(&[("1", &self.limits), ("2", &self.methods), ("3", &self.edges)])
    }

    /// Scales of the tracks that the front end has on labelled vehicles: those of the first row, which are the same ones.
    fn scales_of_labels(&self) -> String {
        let mut out = String::from(
            "| vehicle | track | sightings | assumption | length over the front end's | standard deviation % | observable |\n\
             |---|---|---|---|---|---|---|\n",
        );
        for vehicle in self.methods.first().map_or(&[][..], |row| &row.vehicles) {
            let of_label = |scale: &&BaselineScale| vehicle.estimates.contains(&(scale.track as i64));
            for scale in self.scales.iter().filter(of_label) {
                let assumption = scale.found.map_or("–", |found| match found.assumption {
                    Assumption::Curvilinear => "along its heading",
                    Assumption::Steady => "constant velocity",
                });
                let observable = scale.found.is_some_and(|found| found.is_observable());
                let _ = writeln!(
                    out,
                    "| {} | {} | {} | {assumption} | {} | {} | {} |",
                    vehicle.label,
                    scale.track,
                    scale.sightings,
                    cell(scale.ratio(), 2),
                    cell(scale.relative_sigma().map(|sigma| 100.0 * sigma), 0),
                    if observable { "yes" } else { "no" },
                );
            }
        }
        out
    }
}
