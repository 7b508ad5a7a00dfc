//! `motorcade shape`.

use motorcade_shape::ConvertOptions;
use motorcade_shape::command::{ConvertRequest, PriorReport, convert, export, info};

use crate::arguments::ShapeCommand;
use crate::exit;
use crate::files::{Content, OutFile};

/// Writes or describes a prior.
pub fn shape(command: &ShapeCommand) -> anyhow::Result<u8> {
    let report = match command {
        ShapeCommand::Export { layout, out } => {
            let file = OutFile::create(out, Content::ShapePrior)?;
            let (report, text) = export(*layout, out);
            file.write(&text)?;
            report
        }
        ShapeCommand::Info { prior } => info(prior)?,
        ShapeCommand::Convert(arguments) => {
            let file = OutFile::create(&arguments.out, Content::ShapePrior)?;
            let (report, text) = convert(&ConvertRequest {
                mean: arguments.mean.clone(),
                basis: arguments.basis.clone(),
                output: arguments.out.clone(),
                options: ConvertOptions {
                    length_m: arguments.length,
                    ..ConvertOptions::new(arguments.layout)
                },
            })?;
            file.write(&text)?;
            report
        }
    };
    exit::say(&describe(&report));
    Ok(exit::FINE)
}

fn describe(report: &PriorReport) -> String {
    let size = report.mean_size;
    let own = report.rms_to_own_m.map_or_else(String::new, |rms| format!(", {rms:.3} m RMS from our own"));
    format!(
        "{}: {} keypoints, {} deformations, mean {:.2} x {:.2} x {:.2} m{own}\n{}",
        report.name,
        report.keypoints,
        report.deformations,
        size.length_m,
        size.width_m,
        size.height_m,
        report.path.display()
    )
}
