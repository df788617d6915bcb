//! Which walks lie in a folder, and what each can be judged by.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::cli::failure::Failure;

/// A walk that was recorded or simulated.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Recording {
    /// The folder's name.
    pub(super) set: String,
    pub(super) name: String,
    pub(super) left: Option<PathBuf>,
    pub(super) right: Option<PathBuf>,
    pub(super) judge: Judge,
}

/// What a walk is judged by.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Judge {
    MotionCapture(PathBuf),
    GroundPoints(PathBuf),
    /// It ended where it began.
    ClosedLoop,
    /// Only its two feet can be held against each other.
    Feet,
    /// A simulated walk's folder.
    Simulated {
        truth: PathBuf,
        folder: PathBuf,
    },
    /// One foot, and nothing known.
    Nothing,
}

/// Finds the walks of files and folders, in the order of their names.
pub(super) fn find(paths: &[PathBuf], closed: bool) -> Result<Vec<Recording>> {
    let mut found = Vec::new();
    for path in paths {
        let metadata = fs::metadata(path)
            .map_err(|error| Failure::bad_input(path, format!("cannot be read: {error}")))?;
        if metadata.is_dir() {
            in_folder(path, closed, &mut found)?;
        } else {
            let folder =
                path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let Some((name, _)) = taken_apart(path) else {
                return Err(Failure::bad_input(
                    path,
                    "expected a name that ends in .csv, .csv.gz or .csv.zst",
                ));
            };
            let walks = group(folder, closed)?;
            found.extend(
                walks
                    .into_iter()
                    .filter(|walk| walk.name == name && !found.contains(walk))
                    .collect::<Vec<_>>(),
            );
        }
    }
    Ok(found)
}

fn in_folder(folder: &Path, closed: bool, found: &mut Vec<Recording>) -> Result<()> {
    found.extend(group(folder, closed)?);
    for entry in entries(folder)? {
        if entry.is_dir() {
            in_folder(&entry, closed, found)?;
        }
    }
    Ok(())
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let cannot = |error: std::io::Error| Failure::bad_input(folder, format!("cannot be read: {error}"));
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(cannot)? {
        paths.push(entry.map_err(cannot)?.path());
    }
    paths.sort();
    Ok(paths)
}

/// The walks whose files lie directly in a folder.
fn group(folder: &Path, closed: bool) -> Result<Vec<Recording>> {
    let mut walks: BTreeMap<String, BTreeMap<Part, PathBuf>> = BTreeMap::new();
    for path in entries(folder)?.into_iter().filter(|path| path.is_file()) {
        if let Some((name, part)) = taken_apart(&path) {
            walks.entry(name).or_default().insert(part, path);
        }
    }
    let set = folder
        .canonicalize()
        .ok()
        .and_then(|full| Some(full.file_name()?.to_string_lossy().into_owned()))
        .unwrap_or_default();
    let lone = |name: &str| walks.get(name).and_then(|parts| parts.get(&Part::Log)).cloned();
    if let (Some(left), Some(right), Some(truth)) = (lone("left"), lone("right"), lone("truth")) {
        let judge = Judge::Simulated { truth, folder: folder.to_owned() };
        let set_of_folders = folder
            .canonicalize()
            .ok()
            .and_then(|full| Some(full.parent()?.file_name()?.to_string_lossy().into_owned()));
        let (left, right) = (Some(left), Some(right));
        return Ok(vec![Recording {
            set: set_of_folders.unwrap_or_default(),
            name: set,
            left,
            right,
            judge,
        }]);
    }
    let closed = closed || set.contains("openshoe") || set.contains("ngimu");
    Ok(walks
        .into_iter()
        .filter_map(|(name, mut parts)| {
            let log = parts.remove(&Part::Log);
            let right = parts.remove(&Part::Right);
            let left = parts.remove(&Part::Left).or(log);
            if left.is_none() && right.is_none() {
                return None;
            }
            let judge = match (parts.remove(&Part::Truth), parts.remove(&Part::Points)) {
                (Some(truth), _) => Judge::MotionCapture(truth),
                (None, Some(points)) => Judge::GroundPoints(points),
                (None, None) if closed => Judge::ClosedLoop,
                (None, None) if left.is_some() && right.is_some() => Judge::Feet,
                (None, None) => Judge::Nothing,
            };
            Some(Recording { set: set.clone(), name, left, right, judge })
        })
        .collect())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Log,
    Left,
    Right,
    Truth,
    Points,
}

/// `NAME.left.csv.gz` as its name and its part.
fn taken_apart(path: &Path) -> Option<(String, Part)> {
    let name = path.file_name()?.to_str()?;
    let name = name.strip_suffix(".gz").or_else(|| name.strip_suffix(".zst")).unwrap_or(name);
    let name = name.strip_suffix(".csv").filter(|name| !name.starts_with('.'))?;
    let parts =
        [(".left", Part::Left), (".right", Part::Right), (".truth", Part::Truth), (".points", Part::Points)];
    let part = parts.into_iter().find_map(|(ending, part)| Some((name.strip_suffix(ending)?, part)));
    let (name, part) = part.unwrap_or((name, Part::Log));
    // Beside a simulated walk.
    (!matches!(name, "markers" | "visits")).then(|| (name.to_owned(), part))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(parent: &Path, name: &str, files: &[&str]) -> PathBuf {
        let folder = parent.join(name);
        fs::create_dir(&folder).unwrap();
        for file in files {
            fs::write(folder.join(file), "").unwrap();
        }
        folder
    }

    #[test]
    fn files_are_put_together_and_judged_by_what_lies_beside_them() {
        let all = tempfile::tempdir().unwrap();
        let vicon = folder(all.path(), "vicon", &["a.csv.gz", "a.truth.csv.gz", "b.csv", "README.md"]);
        folder(all.path(), "feet", &["up.left.csv.gz", "up.right.csv.gz"]);
        folder(all.path(), "openshoe", &["loop.csv.zst"]);
        folder(
            all.path(),
            "spiral",
            &["left.csv", "right.csv", "truth.csv", "markers.csv", "visits.csv", "site.toml"],
        );
        let found = find(&[all.path().to_owned()], false).unwrap();
        let told: Vec<_> = found.iter().map(|r| (r.set.as_str(), r.name.as_str(), r.judge.clone())).collect();
        assert_eq!(told[0], ("feet", "up", Judge::Feet));
        assert_eq!(told[1], ("openshoe", "loop", Judge::ClosedLoop));
        assert_eq!((told[2].1, matches!(told[2].2, Judge::Simulated { .. })), ("spiral", true));
        assert_eq!(told[3], ("vicon", "a", Judge::MotionCapture(vicon.join("a.truth.csv.gz"))));
        assert_eq!(told[4], ("vicon", "b", Judge::Nothing));
        assert_eq!(told.len(), 5);
        let twice = find(&[vicon.join("a.csv.gz"), vicon.join("a.truth.csv.gz")], false).unwrap();
        assert_eq!(twice.len(), 1);
        assert_eq!(find(&[vicon.join("b.csv")], true).unwrap()[0].judge, Judge::ClosedLoop);
        assert!(find(&[vicon.join("README.md")], false).is_err());
    }
}
