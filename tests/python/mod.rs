//! Programs that are not ours, for second opinions: Python and what is installed beside it.

use std::{path::Path, process::Command};

/// Python with the packages of tests/requirements.txt.
#[allow(dead_code, reason = "some tests ask the peers alone")]
pub const PYTHON: &str = "venv/bin/python";

/// What a program under `.deps/` prints. `arguments` fills in its command line; paths start at the root of the source.
pub fn run(program: &str, arguments: impl FnOnce(&mut Command) -> &mut Command) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(".deps").join(program);
    // The larger programs stand with the benchmarks' peers.
    assert!(path.exists(), "{} is missing: run `make deps-test`, for slow tests `make test-slow`", path.display());
    let mut command = Command::new(path);
    let output = arguments(&mut command).output().expect("the program starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{command:?}: {}{}", text(&output.stdout), text(&output.stderr));
    String::from_utf8(output.stdout).expect("it prints UTF-8")
}
