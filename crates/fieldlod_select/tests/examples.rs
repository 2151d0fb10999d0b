//! The example runs.

use std::path::Path;
use std::process::Command;

#[test]
fn headless_server_selects_more_for_the_near_player() {
    let test = std::env::current_exe().unwrap();
    let examples = test.ancestors().nth(2).unwrap().join("examples");
    let program = Path::new("headless_server").with_extension(std::env::consts::EXE_EXTENSION);
    let program = examples.join(program);
    assert!(
        program.is_file(),
        "{} does not exist; run `cargo build --examples`",
        program.display()
    );
    let output = Command::new(program).output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    let triangles = |player: &str| -> u64 {
        let line = text.lines().rfind(|line| line.contains(player)).unwrap();
        let count = line.split("needs ").nth(1).unwrap().split(' ').next();
        count.unwrap().parse().unwrap()
    };
    assert!(triangles("near") > triangles("far"), "{text}");
    assert!(triangles("far") > 0);
}
