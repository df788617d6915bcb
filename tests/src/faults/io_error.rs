//! A disk that does not do what it should: one sync or write fails, the next would succeed again.

use std::ffi::OsString;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;

use super::audit::audit;
use super::process::{NotStarted, Program};
use super::scene::{Outcome, Scale, Scene, wrong_in_the_end};
use super::script::Script;

/// The exit code of a server whose disk failed.
pub const DISK_FAILED: i32 = 74;
/// How long the work may take, once before the fault and once after it.
const ENDS_WITHIN: Duration = Duration::from_secs(180);

/// What is made to fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// This sync (`fsync` or `fdatasync`) of any thread, counted by thread, answers EIO once.
    Sync(u64),
    /// This write of any thread to the database or its log answers EIO once.
    Write(u64),
    /// No file may grow beyond so many blocks of the shell's `ulimit -f`.
    LargestFile(u64),
}

/// What came of it.
#[derive(Clone, Debug, Default)]
pub struct Came {
    /// The server ended while it started, and said why.
    pub at_the_start: bool,
    /// The server ended while it served.
    pub while_serving: bool,
    /// What was not as promised.
    pub wrong: Vec<String>,
}

/// Why faults of single calls cannot be made here; `None` when they can.
pub fn no_strace() -> Option<&'static str> {
    let mut strace = std::process::Command::new("strace");
    let tried = strace.args(["-qq", "-f", "-o", "/dev/null", "-e", "trace=fsync", "true"]).output();
    match tried {
        Ok(output) if output.status.success() => None,
        Ok(_) => Some("strace may not trace here"),
        Err(_) => Some("there is no strace"),
    }
}

/// Starts the program so that this fails.
fn with(program: &Program, fault: Fault) -> Program {
    let strace = |call: &str, more: Vec<OsString>| {
        let mut words: Vec<OsString> =
            ["strace", "-D", "-f", "-qq", "-o", "/dev/null", "-e"].map(OsString::from).to_vec();
        words.push(call.into());
        words.extend(more);
        words
    };
    let words = match fault {
        Fault::Sync(n) => strace(&format!("inject=fsync,fdatasync:error=EIO:when={n}"), Vec::new()),
        Fault::Write(n) => {
            let file = |name: &str| [OsString::from("-P"), program.data().join(name).into()];
            let files = ["lodestep.db", "lodestep.db-wal"].iter().flat_map(|name| file(name));
            strace(&format!("inject=write,pwrite64:error=EIO:when={n}"), files.collect())
        }
        // The signal is let pass, so that the write is answered with an error.
        Fault::LargestFile(blocks) => {
            let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\"");
            ["sh", "-c", &limited, "sh"].map(OsString::from).to_vec()
        }
    };
    program.clone().under(words)
}

/// Lets everybody work on a server with this fault; then, on one without, to the end.
pub async fn fail(fault: Fault, scripts: &[Arc<Script>], scale: Scale, expected: &Outcome) -> Came {
    let mut came = Came::default();
    let folder = TempDir::new().expect("a temporary folder can be made");
    let program = Program::on(folder.path());
    let running = program.start().await;
    let mut scene = Scene::prepare(running.address, scripts, scale).await;
    running.terminate().await;
    scene.server_is_at(None);
    scene.begin();
    match with(&program, fault).try_start().await {
        Err(NotStarted { status, log }) => {
            came.at_the_start = true;
            if status.is_none_or(|status| status.success()) || !log.contains("lodestep: ") {
                came.wrong.push(format!("{fault:?}: at the start {status:?}, and said {log}"));
            }
        }
        Ok(mut running) => {
            scene.server_is_at(Some(running.address));
            let ended = tokio::select! {
                ended = running.wait() => Some(ended),
                _ = scene.work_for(ENDS_WITHIN) => None,
            };
            scene.server_is_at(None);
            came.while_serving = ended.is_some();
            match ended {
                Some(status) if status.code() == Some(DISK_FAILED) => {}
                Some(status) => came.wrong.push(format!("{fault:?}: ended with {status}: {}", running.log())),
                None => drop(running.terminate().await),
            }
        }
    }
    came.wrong.extend(audit(folder.path(), &scene).await);
    came.wrong.extend(go_on(folder.path(), &program, &mut scene, expected).await);
    came.wrong.iter_mut().for_each(|sentence| *sentence = format!("{fault:?}: {sentence}"));
    came
}

/// Everybody comes to the end on a server that is well; what is wrong then.
async fn go_on(data: &Path, program: &Program, scene: &mut Scene, expected: &Outcome) -> Vec<String> {
    let running = program.start().await;
    scene.server_is_at(Some(running.address));
    let outcome = scene.end(ENDS_WITHIN).await;
    running.terminate().await;
    wrong_in_the_end(data, scene, &outcome, expected).await
}
