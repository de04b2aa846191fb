//! Processes at work, and signals to them.
#![cfg(unix)]

use std::process::{Child, Command};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// How often a condition is looked at.
const LOOK: Duration = Duration::from_millis(10);
/// How long a condition is waited for, on however busy a machine.
const PATIENCE: Duration = Duration::from_secs(300);

/// Waits until the condition holds.
pub(crate) fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "waited in vain: {what}");
        sleep(LOOK);
    }
}

/// Waits until the process has worked for so many seconds of processor time, or has ended: unlike a time of the clock, that
/// is the same step of its work on a busy machine.
pub(crate) fn wait_for_work(child: &mut Child, seconds: f64) {
    wait_until("work", || {
        worked(child).is_none_or(|worked| worked >= seconds)
    });
}

/// Waits for the end of the process, and says how many seconds of processor time it took.
pub(crate) fn work_of(child: &mut Child) -> f64 {
    let mut last = 0.0;
    while let Some(seconds) = worked(child) {
        last = seconds;
        sleep(LOOK);
    }
    last
}

/// Waits until the process, which has worked, works no more, though it has not ended.
pub(crate) fn wait_for_rest(child: &mut Child) {
    let mut before = 0.0;
    wait_until("rest", || {
        sleep(20 * LOOK);
        let now = worked(child).expect("it waits, too");
        std::mem::replace(&mut before, now) == now && now > 0.0
    });
}

/// Sends a signal.
pub(crate) fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    let status = Command::new("kill").args([name, &id]).status();
    assert!(status.expect("there is a `kill`").success(), "{name}");
}

/// Seconds of processor time, unless the process has ended.
#[cfg(target_os = "linux")]
fn worked(child: &mut Child) -> Option<f64> {
    /// Of the clock that Linux counts in here, on every machine.
    const TICKS_PER_SECOND: f64 = 100.0;
    if child.try_wait().expect("a child").is_some() {
        return None;
    }
    let path = format!("/proc/{}/stat", child.id());
    let stat = std::fs::read_to_string(path).ok()?;
    // After the name, which may have spaces: the state and 10 numbers come before.
    let (_, fields) = stat.rsplit_once(") ")?;
    let ticks = fields.split(' ').skip(11).take(2);
    let ticks: f64 = ticks
        .map(|ticks| ticks.parse::<f64>().expect("ticks"))
        .sum();
    Some(ticks / TICKS_PER_SECOND)
}

/// Seconds of processor time by `ps`, as minutes and seconds, unless the process has ended.
#[cfg(not(target_os = "linux"))]
fn worked(child: &mut Child) -> Option<f64> {
    if child.try_wait().expect("a child").is_some() {
        return None;
    }
    let id = child.id().to_string();
    let output = Command::new("ps").args(["-o", "time=", "-p", &id]).output();
    let text = String::from_utf8(output.ok()?.stdout).ok()?;
    let parts = text.trim().split(':');
    parts
        .map(|part| part.parse::<f64>().ok())
        .try_fold(0.0, |sum, part| Some(60.0 * sum + part?))
}
