//! A clock that somebody sets while the server runs: forwards, backwards, by seconds and by years.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;

use super::process::Program;
use super::random::Random;
use super::scene::{Outcome, Scale, Scene, wrong_in_the_end};
use super::script::Script;

/// Between two steps, at most.
const STANDS_FOR: Duration = Duration::from_millis(400);
/// By how much the clock is wrong, s: more than any rest, than any time an upload may lie, than any token lives.
const STEPS_S: [i64; 10] = [-400_000_000, -90_000, -3_700, -61, -1, 2, 59, 3_600, 8 * 86_400, 300_000_000];
/// How long the work may take.
const ENDS_WITHIN: Duration = Duration::from_secs(180);

/// What came of it.
#[derive(Clone, Debug, Default)]
pub struct Stepped {
    /// How often the clock was set.
    pub steps: u64,
    /// What was not as promised.
    pub wrong: Vec<String>,
}

/// The library that tells a program another time; `None`, where there is none.
pub fn faketime() -> Option<PathBuf> {
    let machine = std::env::consts::ARCH;
    let folders = [
        format!("/usr/lib/{machine}-linux-gnu/faketime"),
        "/usr/lib64/faketime".into(),
        "/usr/lib/faketime".into(),
    ];
    folders.iter().map(|folder| PathBuf::from(folder).join("libfaketimeMT.so.1")).find(|path| path.is_file())
}

/// Sets the server's clock so many times while everybody works; the time that passes goes on as it did.
pub async fn step(
    library: PathBuf,
    steps: u64,
    scripts: &[Arc<Script>],
    scale: Scale,
    expected: &Outcome,
    random: &mut Random,
) -> Stepped {
    let mut came = Stepped::default();
    while came.steps < steps {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let settings = TempDir::new().expect("a temporary folder can be made");
        let offset = settings.path().join("offset");
        let set = |offset_s: i64| {
            // Whole, or not at all: the server reads it whenever it asks for the time.
            let next = settings.path().join("next");
            std::fs::write(&next, format!("{offset_s:+}\n")).expect("a small file can be written");
            std::fs::rename(&next, &offset).expect("a file can be renamed");
        };
        set(0);
        let program = Program::on(folder.path())
            .with("LD_PRELOAD", library.as_os_str())
            .with("FAKETIME_TIMESTAMP_FILE", offset.as_os_str())
            .with("FAKETIME_NO_CACHE", "1")
            .with("FAKETIME_DONT_FAKE_MONOTONIC", "1");
        let running = program.start().await;
        let mut scene = Scene::prepare(running.address, scripts, scale).await;
        scene.begin();
        while came.steps < steps && !scene.work_for(random.within(STANDS_FOR)).await {
            set(STEPS_S[random.below(STEPS_S.len() as u64) as usize]);
            came.steps += 1;
        }
        let outcome = scene.end(ENDS_WITHIN).await;
        running.terminate().await;
        came.wrong.extend(wrong_in_the_end(folder.path(), &scene, &outcome, expected).await);
    }
    came
}
