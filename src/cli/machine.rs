//! Facts of the environment and the machine: SIMD level, threads, signals, memory.

use std::{
    env, fs,
    num::NonZero,
    path::{Path, PathBuf},
    process::Command,
    sync::{Arc, atomic::AtomicBool},
    thread,
    time::Duration,
};

use super::exit::{Exit, Failure};
use factory::{Cancel, Parallelism, cluster::granted_threads, job::JobContext};
use kernel::{files, geom::SimdLevel, words::Show};

/// Environment variable that names the folder of mesh packages.
const PACKAGES: &str = "GRASPMILL_PACKAGES";

/// SIMD level: `GRASPMILL_SIMD` if set, else the best of this machine.
pub fn simd_level() -> Result<SimdLevel, Failure> {
    let best = SimdLevel::detect();
    let Some(text) = env::var_os("GRASPMILL_SIMD") else { return Ok(best) };
    let wanted: SimdLevel = text
        .to_string_lossy()
        .parse()
        .map_err(|error| Failure::message(Exit::BadSpec, format!("GRASPMILL_SIMD: {error}")))?;
    if wanted > best {
        return Err(Failure::message(
            Exit::BadSpec,
            format!("GRASPMILL_SIMD={wanted}: this machine supports at most {best}"),
        ));
    }
    Ok(wanted)
}

/// Starts the program again with [`sim::GL_ENVIRONMENT`] if the variable is not set; returns otherwise.
pub fn set_gl_environment() -> Result<(), Failure> {
    use std::os::unix::process::CommandExt;

    let (name, value) = sim::GL_ENVIRONMENT;
    if env::var_os(name).is_some() {
        return Ok(());
    }
    let error = Command::new(env::current_exe()?).args(env::args_os().skip(1)).env(name, value).exec();
    Err(Failure::message(
        Exit::Failed,
        format!("cannot restart with {name}={value}: {error}; set the variable yourself and run again"),
    ))
}

/// Requested or granted threads, with the vector instructions that the environment selects.
pub fn parallelism(asked: Option<u16>) -> Result<Parallelism, Failure> {
    Ok(Parallelism { threads: threads(asked), level: simd_level()? })
}

/// Requested number of threads, or else the number that affinity, cgroup quota and the cluster engine grant.
pub fn threads(asked: Option<u16>) -> usize {
    let available = || thread::available_parallelism().map_or(1, NonZero::get);
    let granted = || granted_threads(&variable).map_or_else(available, |grant| grant.threads.min(available()));
    asked.map_or_else(granted, usize::from)
}

/// Value of an environment variable; `None` if it is empty.
pub fn variable(name: &str) -> Option<String> {
    env::var(name).ok().filter(|value| !value.is_empty())
}

/// Folder of the mesh packages that jobs name: GRASPMILL_PACKAGES if set, else that of the program.
pub fn packages() -> Result<PathBuf, Failure> {
    let Some(named) = variable(PACKAGES) else { return Ok(JobContext::default().packages) };
    let path = PathBuf::from(named);
    if path.is_absolute() {
        return Ok(path);
    }
    let message = format!("{PACKAGES}={}: give an absolute path", path.shown());
    Err(Failure::message(Exit::BadSpec, message))
}

/// Finds an external program on PATH. Relative folders in PATH are skipped, for this program and for the started one, because the
/// current folder contains data. `None` if there is no such program.
pub fn program(name: &str) -> Option<Command> {
    let path = env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = env::split_paths(&path).filter(|folder| folder.is_absolute()).collect();
    // A name with a folder in it, as in BROWSER, is a path; an absolute one stays the same when joined with a folder.
    let candidates = folders.iter().map(|folder| folder.join(name));
    let found = candidates.filter(|_| !name.contains('/') || name.starts_with('/')).find(|file| is_executable(file))?;
    let mut command = Command::new(found);
    command.env("PATH", env::join_paths(folders).ok()?);
    Some(command)
}

fn is_executable(file: &Path) -> bool {
    files::is_file(file) && rustix::fs::access(file, rustix::fs::Access::EXEC_OK).is_ok()
}

/// Ignores the signal XFSZ, so that a write beyond the file size limit (`ulimit -f`) returns an error instead of killing the
/// program without a message.
pub fn outlive_file_limits() -> Result<(), Failure> {
    let seen = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, seen)?;
    Ok(())
}

/// Cancellation token that INT, TERM and USR1 set; a second signal ends the program at once.
pub fn cancel_on_signals() -> Result<Arc<Cancel>, Failure> {
    use signal_hook::{
        consts::{SIGINT, SIGTERM, SIGUSR1},
        iterator::Signals,
    };
    let cancel = Arc::new(Cancel::new());
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGUSR1])?;
    let seen = Arc::clone(&cancel);
    thread::Builder::new().name("signals".to_owned()).spawn(move || {
        for signal in signals.forever() {
            if seen.is_cancelled() {
                // Restores the signal's default action and raises it, so that the program ends by the signal.
                let _ = signal_hook::low_level::emulate_default_handler(signal);
            }
            seen.cancel();
        }
    })?;
    Ok(cancel)
}

/// Processor time of all threads of this process since its start.
pub fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
}

/// Peak resident memory of this process [bytes], if the system reports it.
pub fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

/// Free space of the file system that contains `path` [bytes], if the system reports it.
pub fn free_disk(path: &Path) -> Option<u64> {
    let facts = rustix::fs::statvfs(path).ok()?;
    Some(facts.f_bavail * facts.f_frsize)
}
