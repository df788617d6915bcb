//! RINEX files of both kinds, and the rows that a session keeps of them.

use lodestep_engine::gnss::observation_reader;
use lodestep_engine::gnss::observations::Epoch;
use lodestep_engine::parse::observation_rows::EpochReader;
use lodestep_engine::parse::{navigation_rows, observation_rows};
use lodestep_engine::stream::Rows;

use crate::sentence;

/// The first byte: whether what follows is read as observations or as orbits.
pub(crate) fn run(bytes: &[u8]) {
    let Some((said, file)) = bytes.split_first() else { return };
    if said & 1 == 0 { observations(file) } else { orbits(file) }
}

fn observations(file: &[u8]) {
    match (observation_rows::read(file), observation_reader::read(file)) {
        (Ok((rows, notes)), Ok(read)) => {
            assert_eq!(notes, read.notes);
            let mut reader = EpochReader::default();
            let again: Vec<Epoch> = rows_of(&rows).flat_map(|values| reader.take(values)).flatten().collect();
            assert_eq!(again, read.epochs, "a session keeps other epochs than its file has");
            assert!(read.epochs.windows(2).all(|pair| pair[0].time < pair[1].time));
        }
        (Err(error), Err(_)) => sentence::check(&error, file),
        (rows, read) => panic!("the two ways of reading differ: {rows:?} {read:?}"),
    }
}

fn orbits(file: &[u8]) {
    match navigation_rows::read(file) {
        Ok((rows, _)) => {
            let mut navigation = Default::default();
            let taken =
                rows_of(&rows).filter(|values| navigation_rows::take(values, &mut navigation)).count();
            assert_eq!(taken, rows.len(), "a session keeps fewer orbits than its file has");
        }
        Err(error) => sentence::check(&error, file),
    }
}

fn rows_of(rows: &Rows) -> impl Iterator<Item = &[f64]> {
    rows.iter().map(|(_, values)| values)
}
