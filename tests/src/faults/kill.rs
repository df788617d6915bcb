//! kill −9 at random moments: while everybody works, while jobs run, while the server starts.

use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;

use super::audit::audit;
use super::process::Program;
use super::random::Random;
use super::scene::{Outcome, Scale, Scene, wrong_in_the_end};
use super::script::Script;

/// How long a server lives at most once it answers.
const LIVES: Duration = Duration::from_millis(600);
/// How long one lives that is killed while it starts.
const STARTS: Duration = Duration::from_millis(120);
/// How many in a hundred are killed again while they start.
const KILLED_AT_THE_START: u64 = 15;
/// Servers killed on one data folder; then another is begun, so that walks stay short.
const KILLS_A_FOLDER: u64 = 20;
/// How long what is left may take once nobody kills any more.
const ENDS_WITHIN: Duration = Duration::from_secs(180);

/// What came of it.
#[derive(Clone, Debug, Default)]
pub struct Killed {
    /// Servers killed.
    pub kills: u64,
    /// Of these, while they started.
    pub at_the_start: u64,
    /// Data folders, each worked on to the end.
    pub folders: u64,
    /// From each start until the server answered.
    pub up_after: Vec<Duration>,
    /// Batches that were acknowledged.
    pub batches: u64,
    /// Links that had to be made again.
    pub links: u64,
    /// What was not as promised.
    pub wrong: Vec<String>,
}

/// Kills so many servers while the scene goes on.
pub async fn kill(
    kills: u64,
    scripts: &[Arc<Script>],
    scale: Scale,
    expected: &Outcome,
    random: &mut Random,
) -> Killed {
    let mut came = Killed::default();
    while came.kills < kills {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let program = Program::on(folder.path());
        let mut running = program.start().await;
        let mut scene = Scene::prepare(running.address, scripts, scale).await;
        scene.begin();
        let until = kills.min(came.kills + KILLS_A_FOLDER);
        while came.kills < until && !scene.work_for(random.within(LIVES)).await {
            running.kill().await;
            scene.server_is_at(None);
            came.kills += 1;
            while came.kills < until && random.percent(KILLED_AT_THE_START) {
                program.start_and_kill(random.within(STARTS)).await;
                came.kills += 1;
                came.at_the_start += 1;
            }
            came.wrong.extend(audit(folder.path(), &scene).await);
            running = program.start().await;
            came.up_after.push(running.answered_after);
            scene.server_is_at(Some(running.address));
        }
        let outcome = scene.end(ENDS_WITHIN).await;
        running.terminate().await;
        came.wrong.extend(wrong_in_the_end(folder.path(), &scene, &outcome, expected).await);
        let told = scene.promises.told();
        came.batches += told.batches.values().flatten().sum::<u64>();
        came.links += told.links;
        came.folders += 1;
    }
    came
}
