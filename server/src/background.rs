//! Long computations that make room for live work: on threads of their own, at a lower priority.
//!
//! A walk that was handed in can wait a second longer; an acknowledgement cannot. The kernel then gives the threads
//! of the live sessions what they ask for, and these the rest.

use std::panic::AssertUnwindSafe;

use tokio::sync::oneshot;

/// Steps of niceness below the server's other threads: about a tenth of their share, where both want all of a core.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct GaveUp(String);

/// Does a piece of work that may take long, and gives its answer.
pub(crate) async fn in_background<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, GaveUp> {
    let (answer, answered) = oneshot::channel();
    let thread = std::thread::Builder::new().name("background".into()).spawn(move || {
        make_room();
        let done = std::panic::catch_unwind(AssertUnwindSafe(work));
        // Who no longer waits need not be told.
        let _ = answer.send(done);
    });
    if let Err(error) = thread {
        return Err(GaveUp(format!("no thread could be started for it: {error}")));
    }
    match answered.await {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(panic)) => Err(GaveUp(told(panic.as_ref()))),
        Err(_) => Err(GaveUp("its thread is gone".to_owned())),
    }
}

fn told(panic: &(dyn std::any::Any + Send)) -> String {
    let text =
        panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("it panicked").to_owned()
}

/// Lowers this thread's own priority.
#[cfg(target_os = "linux")]
fn make_room() {
    // To Linux a thread is a process to which its own number is given.
    if let Err(error) = rustix::process::setpriority_process(Some(rustix::thread::gettid()), NICENESS) {
        tracing::debug!(%error, "a long computation keeps the server's priority: {error}");
    }
}

#[cfg(not(target_os = "linux"))]
fn make_room() {}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn work_is_done_elsewhere_and_a_panic_is_an_answer() {
        let here = std::thread::current().id();
        assert_ne!(in_background(|| std::thread::current().id()).await.unwrap(), here);
        let gave_up = in_background(|| panic!("three legs")).await.unwrap_err();
        assert_eq!(gave_up.to_string(), "three legs");
    }

    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn such_work_has_a_lower_priority_and_nobody_else() {
        let niceness = || rustix::process::getpriority_process(Some(rustix::thread::gettid())).unwrap();
        let here = niceness();
        assert_eq!(in_background(niceness).await.unwrap(), here.clamp(NICENESS, 19));
        assert_eq!(niceness(), here);
    }
}
