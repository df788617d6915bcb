//! A disk without room: what is there stays, what comes is refused, and all goes on by itself when there is room.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

use reqwest::Method;
use tempfile::TempDir;

use super::process::Program;
use super::scene::{Outcome, Scale, Scene, wrong_in_the_end};
use super::script::Script;

/// How large the disk is, KiB.
const DISK_KIB: u64 = 64 << 10;
/// How long everybody is refused before there is room.
const REFUSED_FOR: Duration = Duration::from_millis(1500);
/// How long the disk may take to fill, and the work to come to its end.
const ENDS_WITHIN: Duration = Duration::from_secs(180);

/// A file system in memory, of its own size; gone when it is dropped.
#[derive(Debug)]
pub struct SmallDisk {
    folder: TempDir,
}

impl SmallDisk {
    /// Mounts one.
    ///
    /// # Errors
    ///
    /// In a sentence, where that is not allowed.
    pub fn mount() -> Result<SmallDisk, String> {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &format!("size={DISK_KIB}k"), "lodestep-tests"])
            .arg(folder.path())
            .output();
        match mounted {
            Ok(output) if output.status.success() => Ok(SmallDisk { folder }),
            Ok(output) => Err(format!(
                "a file system of a given size cannot be mounted here: {}",
                String::from_utf8_lossy(&output.stderr).trim()
            )),
            Err(error) => Err(format!("there is no mount: {error}")),
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// The room on it, KiB.
    fn free_kib(&self) -> u64 {
        let output = Command::new("df").args(["--output=avail", "-k"]).arg(self.path()).output();
        let output = output.expect("df is there where mount is");
        let text = String::from_utf8_lossy(&output.stdout);
        text.lines().nth(1).and_then(|line| line.trim().parse().ok()).expect("df tells a number")
    }

    fn ballast(&self) -> PathBuf {
        self.path().join("ballast")
    }

    /// Leaves so much room, KiB.
    pub fn fill_up_to(&self, free_kib: u64) {
        let bytes = self.free_kib().saturating_sub(free_kib) << 10;
        std::fs::write(self.ballast(), vec![0; bytes as usize]).expect("there is room for that much");
    }

    /// Makes room.
    pub fn clear(&self) {
        std::fs::remove_file(self.ballast()).expect("the ballast can be thrown off");
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(self.path()).status();
    }
}

/// What came of it.
#[derive(Clone, Debug, Default)]
pub struct Came {
    /// Times that somebody was refused for lack of room.
    pub refusals: u64,
    /// What was not as promised.
    pub wrong: Vec<String>,
}

/// Lets everybody work on a disk with so much room; when they have been refused for a while, makes room.
pub async fn fill(
    disk: &SmallDisk,
    free_kib: u64,
    scripts: &[Arc<Script>],
    scale: Scale,
    expected: &Outcome,
) -> Came {
    let mut came = Came::default();
    let data = disk.path().join("data");
    let program = Program::on(&data);
    let mut running = program.start().await;
    let mut scene = Scene::prepare(running.address, scripts, scale).await;
    disk.fill_up_to(free_kib);
    scene.begin();
    let refused = {
        let promises = Arc::clone(&scene.promises);
        async move {
            while promises.told().refusals == 0 {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        }
    };
    let filled = tokio::select! {
        () = refused => true,
        done = scene.work_for(ENDS_WITHIN) => !done,
    };
    if filled {
        scene.work_for(REFUSED_FOR).await;
        // Reading goes on; and who watches is told.
        let client = reqwest::Client::new();
        let asked = client.get(format!("http://{}/healthz", running.address)).send().await;
        let asked = asked.map(|answer| answer.status().as_u16());
        if !asked.as_ref().is_ok_and(|status| [200, 503].contains(status)) {
            came.wrong.push(format!("on the full disk /healthz answered {asked:?}"));
        }
        let read =
            client.request(Method::GET, format!("http://{}/api/v1/sessions", running.address)).send().await;
        if !read.as_ref().is_ok_and(|answer| answer.status() == 200) {
            came.wrong.push(format!("on the full disk sessions could not be read: {read:?}"));
        }
    }
    disk.clear();
    let outcome = scene.end(ENDS_WITHIN).await;
    if let Some(status) = running.has_ended() {
        came.wrong.push(format!("the server ended with {status}: {}", running.log()));
    } else {
        running.terminate().await;
    }
    came.wrong.extend(wrong_in_the_end(&data, &scene, &outcome, expected).await);
    came.wrong.iter_mut().for_each(|sentence| *sentence = format!("{free_kib} KiB free: {sentence}"));
    came.refusals = scene.promises.told().refusals;
    std::fs::remove_dir_all(&data).expect("the folder can be removed");
    came
}
