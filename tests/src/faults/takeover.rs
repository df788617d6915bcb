//! Two servers in turn on one PostgreSQL (docs/cluster.md): the one that works is killed or frozen, the other takes the database
//! over, and one that was frozen goes on with what it had in hand, until it finds that the database is no longer its own.

use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;

use super::audit::audit;
use super::process::Program;
use super::random::Random;
use super::scene::{Outcome, Scale, Scene, wrong_in_the_end};
use super::script::Script;

/// How long a server works at most before the other takes over.
const WORKS: Duration = Duration::from_millis(1_200);
/// How many in a hundred are frozen; the others are killed.
const FROZEN: u64 = 50;
/// How long one that was frozen goes on beside the one that took over, at most.
const BESIDE: Duration = Duration::from_millis(600);
/// Takeovers of one database; then another is begun, so that walks stay short.
const A_DATABASE: u64 = 20;
/// How long what is left may take once nobody takes over any more.
const ENDS_WITHIN: Duration = Duration::from_secs(180);

/// What came of it.
#[derive(Clone, Debug, Default)]
pub struct TakenOver {
    /// Times that the other server took over.
    pub takeovers: u64,
    /// Of these, from one that was frozen and let go on.
    pub frozen: u64,
    /// Databases, each worked on to the end.
    pub databases: u64,
    /// From the death of a server until the other answered.
    pub up_after: Vec<Duration>,
    /// Batches that were acknowledged.
    pub batches: u64,
    /// Links that had to be made again.
    pub links: u64,
    /// What was not as promised.
    pub wrong: Vec<String>,
}

/// Lets the servers take over from each other so often while the scene goes on.
pub async fn take_over(
    takeovers: u64,
    scripts: &[Arc<Script>],
    scale: Scale,
    expected: &Outcome,
    random: &mut Random,
) -> TakenOver {
    let mut came = TakenOver::default();
    while came.takeovers < takeovers {
        // The schema of this folder in the PostgreSQL of the tests.
        let shared = folder();
        let database = shared.path().join("lodestep.db");
        let folders = [folder(), folder()];
        let [one, other] =
            folders.each_ref().map(|own| Program::on(own.path()).with("LODESTEP_DATABASE", &database));
        let (mut now, mut next) = (&one, &other);
        let mut running = now.start().await;
        let mut scene = Scene::prepare(running.address, scripts, scale).await;
        scene.begin();
        let until = takeovers.min(came.takeovers + A_DATABASE);
        while came.takeovers < until && !scene.work_for(random.within(WORKS)).await {
            came.takeovers += 1;
            let freeze = random.percent(FROZEN);
            let before = if freeze {
                running.freeze().await;
                Some(running)
            } else {
                running.kill().await;
                None
            };
            scene.server_is_at(None);
            (now, next) = (next, now);
            running = now.start().await;
            came.up_after.push(running.answered_after);
            scene.server_is_at(Some(running.address));
            if let Some(before) = before {
                came.frozen += 1;
                scene.work_for(random.within(BESIDE)).await;
                before.go_on().await;
                scene.work_for(random.within(BESIDE)).await;
                before.kill().await;
            }
            came.wrong.extend(audit(shared.path(), &scene).await);
        }
        let outcome = scene.end(ENDS_WITHIN).await;
        running.terminate().await;
        came.wrong.extend(wrong_in_the_end(shared.path(), &scene, &outcome, expected).await);
        let told = scene.promises.told();
        came.batches += told.batches.values().flatten().sum::<u64>();
        came.links += told.links;
        came.databases += 1;
    }
    came
}

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder can be made")
}
