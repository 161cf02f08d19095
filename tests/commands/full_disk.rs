use std::process::{Command, Stdio};

use super::harness::{Leo, leo, short_lesson, write};

/// Teaches a robot whose disk is full and later has room again, and prints its log.
const SCRIPT: &str = r#"
mkdir "$1" && mount -t tmpfs -o size=6m tmpfs "$1" || exit 77
export XDG_STATE_HOME="$1"
"$0" run --lesson "$2" --stay >"$1.said" 2>&1 &
hear() {
    for _ in $(seq 1200); do grep -q "$1" "$2.said" && return; sleep 0.05; done
    cat "$2.said"; echo "not heard: $1"; kill -INT $!; exit 1
}
hear "watches how to do" "$1"
dd if=/dev/zero of="$1/fill" bs=1k 2>/dev/null
hear "I cannot remember it beyond today" "$1"
rm "$1/fill"
hear "Now I can remember it beyond today" "$1"
kill -INT $!; wait $!; echo "ended: $?"
cat "$1.said"
"$0" tasks list
"#;

#[test]
fn examples_learned_on_a_full_disk_are_saved_later() {
    let (command, files) = leo(&[]);
    let lesson = write(&files, "lesson.toml", &short_lesson());
    let state = files.path().join("disk").display().to_string();
    let mut inside = Command::new("unshare");
    inside.args(["--mount", "sh", "-c", SCRIPT]).arg(command.get_program()).args([&state, &lesson]);
    inside.current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null());
    let output = Leo::start(inside, files).end();
    if output.status == Some(77) || output.err.starts_with("unshare:") {
        skip::skip("needs `unshare --mount` and the right to mount a tmpfs");
        return;
    }
    assert_eq!(output.status, Some(0), "{output:?}");
    assert!(output.out.contains("ended: 0") && !output.out.contains("starts anew"), "{output:?}");
    let complaints = output.out.matches("the learned tasks cannot be written").count();
    assert_eq!(complaints, 1, "{output:?}");
    let words = "No space left on device (os error 28): make room on its disk, or use another state directory; it is \
                 tried again every 5 s";
    assert!(output.out.contains(words), "{output:?}");
    let last: Vec<_> = output.out.lines().last().unwrap_or_default().split_whitespace().collect();
    assert_eq!(last, ["task", "1", "1", "all"], "{output:?}");
}
