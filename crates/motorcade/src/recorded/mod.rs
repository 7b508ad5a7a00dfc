//! A run's directory read back: its record and its tables.

mod frames;
mod record;
mod table;
mod vehicles;

use std::path::Path;

pub use frames::RecordedFrame;
pub use record::{RecordedCounters, RecordedInput, RunRecord};
pub use vehicles::{RecordedState, RecordedVehicle};

use crate::error::Result;

/// Camera and vehicles of a run, from `frames.csv`, `speeds.csv`, `ego.tum`, `ego_covariance.csv` and `tracks.csv`.
#[derive(Clone, Debug)]
pub struct RecordedRun {
    /// Frames in order; row k of the run is entry k.
    pub frames: Vec<RecordedFrame>,
    /// Vehicles by identity.
    pub vehicles: Vec<RecordedVehicle>,
}

impl RecordedRun {
    /// Reads the tables of a run's directory.
    ///
    /// # Errors
    /// A file that is missing or does not read, tables of different lengths, a vehicle in a frame the run does not have.
    pub fn read(directory: &Path) -> Result<Self> {
        let frames = frames::read(directory)?;
        let vehicles = vehicles::read(&directory.join("tracks.csv"), &frames)?;
        Ok(Self { frames, vehicles })
    }

    /// Row of the frame with this number of the input.
    pub fn row(&self, number: u64) -> Option<usize> {
        // Numbers of an input increase.
        self.frames.binary_search_by_key(&number, |f| f.number).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRACK: &str = "\
frame,id,class,x_m,y_m,z_m,qx,qy,qz,qw,length_m,width_m,height_m,speed_mps,sigma_forward_m,sigma_left_m,sigma_up_m,source,p_moving,score
7,3,Car,1,1.5,20,-0.5,0.5,-0.5,0.5,4,1.8,1.5,9,0.4,0.2,0.1,predicted,0.9,0
";

    const SPEEDS: &str = "frame,time_s,speed_mps,sigma_speed_mps\n5,0.5,7.9,0.2\n7,0.7,8.1,\n";

    fn directory() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write(
            "frames.csv",
            "frame,status,speed_mps,scale_sigma_rel,road_pitch_rad,road_roll_rad\n\
             5,tracked,0,0.02,0,0\n7,bridged,8,0.02,0.1,-0.02\n",
        );
        write("ego.tum", "0.5 0 0 0 0 0 0 1\n0.7 0 0 1.6 0 0 0 1\n");
        let head: String = (0..21).map(|k| format!(",c{k}")).collect();
        let row = |n: u32| format!("\n{n}{}", (0..21).map(|k| format!(",{k}")).collect::<String>());
        write("ego_covariance.csv", &format!("frame{head}{}{}\n", row(5), row(7)));
        write("tracks.csv", TRACK);
        folder
    }

    #[test]
    fn tables_are_read_back() {
        let folder = directory();
        let run = RecordedRun::read(folder.path()).unwrap();
        assert_eq!((run.row(5), run.row(6), run.row(7)), (Some(0), None, Some(1)));
        let frame = &run.frames[1];
        assert_eq!((frame.timestamp_ns, frame.status.as_str()), (700_000_000, "bridged"));
        assert_eq!(
            (frame.covariance[(0, 5)], frame.covariance[(1, 0)], frame.covariance[(5, 5)]),
            (5.0, 1.0, 20.0)
        );
        let n = frame.road_normal;
        assert!(
            ((n.z / n.y).atan() - 0.1).abs() < 1e-12
                && ((n.x / n.y).atan() + 0.02).abs() < 1e-12
                && n.y < 0.0
        );
        let vehicle = &run.vehicles[0];
        assert_eq!((vehicle.id, vehicle.class.as_str(), vehicle.size_m), (3, "Car", [4.0, 1.8, 1.5]));
        assert!(vehicle.states[0].predicted && vehicle.states[0].row == 1);
    }

    /// The step to a frame is not its speed where a recorder lost frames or scale was corrected.
    #[test]
    fn speeds_are_those_of_their_own_table() {
        let folder = directory();
        let read = || RecordedRun::read(folder.path()).unwrap().frames;
        assert_eq!((read()[1].speed_mps, read()[1].speed_sigma_mps), (8.0, Some(0.16)));
        std::fs::write(folder.path().join("speeds.csv"), SPEEDS).unwrap();
        let told: Vec<_> = read().iter().map(|f| (f.speed_mps, f.speed_sigma_mps)).collect();
        assert_eq!(told, [(7.9, Some(0.2)), (8.1, None)]);
    }

    #[test]
    fn errors_name_file_and_line() {
        for (file, from, to, said) in [
            ("tracks.csv", "7,3,Car", "6,3,Car", "tracks.csv:2"),
            ("tracks.csv", ",9,0.4", ",fast,0.4", "speed_mps"),
            ("tracks.csv", "p_moving", "p", "p_moving"),
            ("tracks.csv", "0.4,0.2", "0.4,NaN", "tracks.csv:2"),
            ("frames.csv", "7,bridged", "5,bridged", "frames.csv:3"),
            (
                "ego.tum",
                "0.7 0 0 1.6 0 0 0 1\n",
                "",
                "frames.csv 2, ego.tum 1, ego_covariance.csv 2, speeds.csv 2",
            ),
            ("speeds.csv", "7,0.7,8.1,\n", "", "ego_covariance.csv 2, speeds.csv 1"),
            ("speeds.csv", "7,0.7", "7,0.7,8.1,\n8,0.8", "speeds.csv 3"),
            ("speeds.csv", "7,0.7", "6,0.7", "speeds.csv:3: expected frame 7"),
        ] {
            let folder = directory();
            std::fs::write(folder.path().join("speeds.csv"), SPEEDS).unwrap();
            let path = folder.path().join(file);
            let text = std::fs::read_to_string(&path).unwrap().replacen(from, to, 1);
            std::fs::write(&path, text).unwrap();
            let told = RecordedRun::read(folder.path()).unwrap_err().to_string();
            assert!(told.contains(said), "{told}");
        }
    }
}
