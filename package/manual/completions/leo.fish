# Print an optspec for argparse to handle cmd's options that are independent of any subcommand.
function __fish_leo_global_optspecs
    string join \n config= set= lesson= for= stay faults= domain= v/verbose log-json h/help V/version
end

function __fish_leo_needs_command
    # Figure out if the current invocation already has a command.
    set -l cmd (commandline -opc)
    set -e cmd[1]
    argparse -s (__fish_leo_global_optspecs) -- $cmd 2>/dev/null
    or return
    if set -q argv[1]
        # Also print the command, so this can be used to figure out what it is.
        echo $argv[1]
        return 1
    end
    return 0
end

function __fish_leo_using_subcommand
    set -l cmd (__fish_leo_needs_command)
    test -z "$cmd"
    and return 1
    contains -- $cmd[1] $argv
end

complete -c leo -n "__fish_leo_needs_command" -l config -d 'The robot\'s leo.toml; the files beside it are read too [default: built in]' -r -F
complete -c leo -n "__fish_leo_needs_command" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_needs_command" -l lesson -d 'The lesson to play [default: built in, Task 1 of the study]' -r -F
complete -c leo -n "__fish_leo_needs_command" -l for -d 'Run for this time [default: until the lesson is over]' -r
complete -c leo -n "__fish_leo_needs_command" -l faults -d 'A fault campaign for the servo buses, the percepts and the processes' -r -F
complete -c leo -n "__fish_leo_needs_command" -l domain -d 'The shared-memory domain to run in [default: a new one]' -r -F
complete -c leo -n "__fish_leo_needs_command" -l stay -d 'Run until the robot is stopped, as a service does'
complete -c leo -n "__fish_leo_needs_command" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_needs_command" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_needs_command" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c leo -n "__fish_leo_needs_command" -s V -l version -d 'Print version'
complete -c leo -n "__fish_leo_needs_command" -f -a "run" -d 'Run the whole robot: all processes, simulator and mock servo buses included'
complete -c leo -n "__fish_leo_needs_command" -f -a "teach" -d 'Play a lesson in lockstep time, as fast as the machine can, and print what Leo learned'
complete -c leo -n "__fish_leo_needs_command" -f -a "study" -d 'Play the paper\'s study, with and without perspective taking, beside the paper\'s tables'
complete -c leo -n "__fish_leo_needs_command" -f -a "believe" -d 'Process a recorded trace of observations: perception and belief alone, no processes'
complete -c leo -n "__fish_leo_needs_command" -f -a "evaluate" -d 'Compare the beliefs about a recorded trace with the truth, by the measures of multi-object tracking'
complete -c leo -n "__fish_leo_needs_command" -f -a "learn" -d 'Learn from before-and-after examples in a file: task learning alone, no processes'
complete -c leo -n "__fish_leo_needs_command" -f -a "record" -d 'Record a running robot: every buffer\'s bytes, and messages for common viewers'
complete -c leo -n "__fish_leo_needs_command" -f -a "view" -d 'Serve a running robot to live viewers, such as Foxglove and Lichtblick'
complete -c leo -n "__fish_leo_needs_command" -f -a "replay" -d 'Replay a recording into the belief and learner processes, and compare their output'
complete -c leo -n "__fish_leo_needs_command" -f -a "top" -d 'Show a live table of the processes: rates, latencies, overruns, drops, restarts'
complete -c leo -n "__fish_leo_needs_command" -f -a "arm" -d 'Arm the joints after a person has checked the robot: on hardware nothing moves before'
complete -c leo -n "__fish_leo_needs_command" -f -a "emergency-stop" -d 'Switch every torque off now, and keep it off until it is released'
complete -c leo -n "__fish_leo_needs_command" -f -a "check" -d 'Check the whole configuration and the real-time settings of this machine'
complete -c leo -n "__fish_leo_needs_command" -f -a "bench" -d 'Measure latencies beside the bare middleware and a bare thread, in one run'
complete -c leo -n "__fish_leo_needs_command" -f -a "manual" -d 'Write the manual pages and the shell completions of the package'
complete -c leo -n "__fish_leo_needs_command" -f -a "bench-echo" -d 'The other process of `leo bench`'
complete -c leo -n "__fish_leo_needs_command" -f -a "simulator" -d 'The workspace, the teacher and Leo\'s body'
complete -c leo -n "__fish_leo_needs_command" -f -a "sensor" -d 'Observations to percepts'
complete -c leo -n "__fish_leo_needs_command" -f -a "belief" -d 'Percepts to beliefs'
complete -c leo -n "__fish_leo_needs_command" -f -a "learner" -d 'Beliefs to tasks, tasks to joint goals'
complete -c leo -n "__fish_leo_needs_command" -f -a "motor" -d 'Joint goals to servos, servos to joint states'
complete -c leo -n "__fish_leo_needs_command" -f -a "mock-bus" -d 'Serve mock servo buses to any Dynamixel master, with faults on demand'
complete -c leo -n "__fish_leo_needs_command" -f -a "console" -d 'Prints events and serves the page'
complete -c leo -n "__fish_leo_needs_command" -f -a "link" -d 'Carries frames between this machine and another one'
complete -c leo -n "__fish_leo_needs_command" -f -a "torque-guard" -d 'Switches torque off when the supervisor and the motor process have died together'
complete -c leo -n "__fish_leo_needs_command" -f -a "tasks" -d 'Show, forget, export or import what Leo has learned'
complete -c leo -n "__fish_leo_needs_command" -f -a "bus" -d 'Talk to servos by hand: scan, read, write, torque, reboot, monitor'
complete -c leo -n "__fish_leo_needs_command" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c leo -n "__fish_leo_using_subcommand run" -l config -d 'The robot\'s leo.toml; the files beside it are read too [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand run" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand run" -l lesson -d 'The lesson to play [default: built in, Task 1 of the study]' -r -F
complete -c leo -n "__fish_leo_using_subcommand run" -l for -d 'Run for this time [default: until the lesson is over]' -r
complete -c leo -n "__fish_leo_using_subcommand run" -l faults -d 'A fault campaign for the servo buses, the percepts and the processes' -r -F
complete -c leo -n "__fish_leo_using_subcommand run" -l domain -d 'The shared-memory domain to run in [default: a new one]' -r -F
complete -c leo -n "__fish_leo_using_subcommand run" -l stay -d 'Run until the robot is stopped, as a service does'
complete -c leo -n "__fish_leo_using_subcommand run" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand run" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand run" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand teach" -l perspective -d 'Whose perspectives to take: `human,robot` or `robot` [default: as configured]' -r -f -a "human\t''
robot\t''"
complete -c leo -n "__fish_leo_using_subcommand teach" -l record -d 'Record the lesson for `leo replay` and for viewers; takes one lesson only' -r -F
complete -c leo -n "__fish_leo_using_subcommand teach" -l config -d 'The robot\'s leo.toml [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand teach" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand teach" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand teach" -l force -l overwrite -d 'Replace an existing file'
complete -c leo -n "__fish_leo_using_subcommand teach" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand teach" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand teach" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand study" -l sweep -d 'Instead, teach this number of random designs of each task in one process, with more noise, other cones and other thresholds, and print which settings fail' -r
complete -c leo -n "__fish_leo_using_subcommand study" -l config -d 'The robot\'s leo.toml [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand study" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand study" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand study" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand study" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand study" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand believe" -l config -d 'The robot\'s leo.toml; the files beside it are read too [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand believe" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand believe" -l partners -d 'Partners whose beliefs are simulated, numbered from 1 [default: as configured]' -r
complete -c leo -n "__fish_leo_using_subcommand believe" -l every -d 'Print an instant at most this often; all instants are processed [default: every instant]' -r
complete -c leo -n "__fish_leo_using_subcommand believe" -l literal -d 'Follow the paper literally where Leo departs from it, and print the differences'
complete -c leo -n "__fish_leo_using_subcommand believe" -l json -d 'Print JSON lines: every belief of every perspective at every instant'
complete -c leo -n "__fish_leo_using_subcommand believe" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand believe" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand believe" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l truth -d 'The truth: JSON lines in metres, or CSV of the MOT Challenge in pixels' -r -F
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l detections -d 'Detections instead of a trace: CSV of the MOT Challenge' -r -F
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l frame-rate -d 'Frames per second of the MOT Challenge files; frame 1 is at 0 s' -r
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l pixel -d 'The size of a pixel [default: the median height of the detections\' boxes is 1.7 m]' -r
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l min-score -d 'Use detections of this score and above, with confidence 1 [default: the score is the confidence]' -r
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l announce-after -d 'Sightings after which a belief is announced, and compared [default: 3 for detections, which may be false; otherwise as configured]' -r
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l similarity -d 'What is compared [default: box for a truth in pixels, distance otherwise]' -r -f -a "box\t'Intersection over union of boxes in the image plane, 0.5 or more'
distance\t'The distance of positions, up to `--cut-off`'"
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l cut-off -d 'The largest distance of a match [default: 0.1]' -r
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l save-hypotheses -d 'Write the compared beliefs to a file' -r -F
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l save-trace -d 'Write the detections to a file, as a trace' -r -F
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l config -d 'The robot\'s leo.toml; the files beside it are read too [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l partners -d 'Partners whose beliefs are simulated, numbered from 1 [default: as configured]' -r
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l remembered -d 'Count every belief in every frame, and not only those that were observed in the frame'
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l force -l overwrite -d 'Replace an existing file'
complete -c leo -n "__fish_leo_using_subcommand evaluate" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand evaluate" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand evaluate" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c leo -n "__fish_leo_using_subcommand learn" -l language -d 'The hypothesis language: that of the paper\'s robot, or the extended one [default: as configured]' -r -f -a "paper\t''
extended\t''"
complete -c leo -n "__fish_leo_using_subcommand learn" -l noise -d 'Label noise: how often a teacher errs with one object, from 0 to below 0.5 [default: as configured]' -r
complete -c leo -n "__fish_leo_using_subcommand learn" -l rules -d 'Maximum number of rules to print for each goal' -r
complete -c leo -n "__fish_leo_using_subcommand learn" -l config -d 'The robot\'s leo.toml, for the keys of its table `learner` [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand learn" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand learn" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand learn" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand learn" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand learn" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand record" -l domain -d 'The robot, if several run' -r -F
complete -c leo -n "__fish_leo_using_subcommand record" -l for -d 'End after this time [default: when the robot ends]' -r
complete -c leo -n "__fish_leo_using_subcommand record" -l last -d 'Keep only the last seconds in memory, 1 GB at most, and write them at the end' -r
complete -c leo -n "__fish_leo_using_subcommand record" -l config -d 'The leo.toml that the robot runs with, for what viewers show [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand record" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand record" -l lesson -d 'The lesson that it plays, for its pose in the room [default: built in, Task 1 of the study]' -r -F
complete -c leo -n "__fish_leo_using_subcommand record" -l force -l overwrite -d 'Replace an existing file'
complete -c leo -n "__fish_leo_using_subcommand record" -l black-box -d 'Write the last minutes from the robot\'s own black box into a file now'
complete -c leo -n "__fish_leo_using_subcommand record" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand record" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand record" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand view" -l listen -d 'Where viewers connect' -r
complete -c leo -n "__fish_leo_using_subcommand view" -l origin -d 'Also admit viewers that are web pages of this origin, such as https://viewer.example; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand view" -l domain -d 'The robot, if several run' -r -F
complete -c leo -n "__fish_leo_using_subcommand view" -l config -d 'The leo.toml that the robot runs with, for what viewers show [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand view" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand view" -l lesson -d 'The lesson that it plays, for its pose in the room [default: built in, Task 1 of the study]' -r -F
complete -c leo -n "__fish_leo_using_subcommand view" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand view" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand view" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand replay" -l speed -d 'Replay at this multiple of real time, and print what happens [default: as fast as possible]' -r
complete -c leo -n "__fish_leo_using_subcommand replay" -l from -d 'Compare and print only what comes after this many seconds; the part before is replayed too' -r
complete -c leo -n "__fish_leo_using_subcommand replay" -l to -d 'End after this many seconds of the recording' -r
complete -c leo -n "__fish_leo_using_subcommand replay" -l record -d 'Record the replayed frames and the new output of the processes' -r -F
complete -c leo -n "__fish_leo_using_subcommand replay" -l force -l overwrite -d 'Replace an existing file'
complete -c leo -n "__fish_leo_using_subcommand replay" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand replay" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand replay" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand top" -l config -d 'The robot\'s leo.toml, for the names of its joints [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand top" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand top" -l domain -d 'The robot, if several run' -r -F
complete -c leo -n "__fish_leo_using_subcommand top" -l json -d 'Print the table once, as JSON'
complete -c leo -n "__fish_leo_using_subcommand top" -l openmetrics -d 'Print all metrics once, as OpenMetrics text'
complete -c leo -n "__fish_leo_using_subcommand top" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand top" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand top" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand arm" -l domain -d 'The robot, where several run' -r -F
complete -c leo -n "__fish_leo_using_subcommand arm" -l config -d 'The robot\'s leo.toml, for the names of its joints [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand arm" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand arm" -l acknowledge -d 'Unlock joints too: a person has found the cause of each lock and removed it'
complete -c leo -n "__fish_leo_using_subcommand arm" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand arm" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand arm" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand arm" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand emergency-stop" -l domain -d 'The robot, which need not run yet [default: all that run, those of other users too; release: this user\'s]' -r -F
complete -c leo -n "__fish_leo_using_subcommand emergency-stop" -l config -d 'The robot\'s leo.toml, whose servo buses are opened where no motor process runs [default: as the robot was started]' -r -F
complete -c leo -n "__fish_leo_using_subcommand emergency-stop" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand emergency-stop" -l reason -d 'Who stops it and why, for the robot\'s log' -r
complete -c leo -n "__fish_leo_using_subcommand emergency-stop" -l release -d 'Release the stop: joints move once they are armed again (`leo arm`)'
complete -c leo -n "__fish_leo_using_subcommand emergency-stop" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand emergency-stop" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand emergency-stop" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand check" -l config -d 'The robot\'s leo.toml [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand check" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand check" -l seconds -d 'How long to measure wake-up latencies; 0 to skip' -r
complete -c leo -n "__fish_leo_using_subcommand check" -l state -d 'The state directory; /var/lib/leo for the service [default: $XDG_STATE_HOME/leo or ~/.local/state/leo]' -r -F
complete -c leo -n "__fish_leo_using_subcommand check" -l root -d 'The folder that stands for the root of the machine' -r -F
complete -c leo -n "__fish_leo_using_subcommand check" -l apply -d 'Apply the changes that last until the next boot, and print how to revert them; as root'
complete -c leo -n "__fish_leo_using_subcommand check" -l revert -d 'Revert the changes of --apply; as root'
complete -c leo -n "__fish_leo_using_subcommand check" -l migrate -d 'First migrate --config and the files beside it to this version, and keep a copy of each original'
complete -c leo -n "__fish_leo_using_subcommand check" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand check" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand check" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand check" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bench" -l seconds -d 'How long to measure each rate and size' -r
complete -c leo -n "__fish_leo_using_subcommand bench" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand bench" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bench" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bench" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand manual" -l force -l overwrite -d 'Replace an existing file'
complete -c leo -n "__fish_leo_using_subcommand manual" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand manual" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand manual" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bench-echo" -l domain -r -F
complete -c leo -n "__fish_leo_using_subcommand bench-echo" -l name -r
complete -c leo -n "__fish_leo_using_subcommand bench-echo" -l bytes -r
complete -c leo -n "__fish_leo_using_subcommand bench-echo" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bench-echo" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bench-echo" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand simulator" -l domain -r -F
complete -c leo -n "__fish_leo_using_subcommand simulator" -l incarnation -d 'Incarnation of the process, from one' -r
complete -c leo -n "__fish_leo_using_subcommand simulator" -l parent -d 'Process id of its supervisor, with which it ends; none without supervisor' -r
complete -c leo -n "__fish_leo_using_subcommand simulator" -l kept -d 'Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original files, so that a restarted process has the same configuration' -r -F
complete -c leo -n "__fish_leo_using_subcommand simulator" -l lesson -d 'The lesson to play; default: the built-in one' -r -F
complete -c leo -n "__fish_leo_using_subcommand simulator" -l synthetic -d 'Number of objects of a synthetic lesson, played instead' -r
complete -c leo -n "__fish_leo_using_subcommand simulator" -l partners -d 'Number of partners whose perspective is simulated; default: the configuration\'s value' -r
complete -c leo -n "__fish_leo_using_subcommand simulator" -l state -d 'The state directory; default: nothing is stored' -r -F
complete -c leo -n "__fish_leo_using_subcommand simulator" -l campaign -d 'The fault campaign; default: no faults are injected' -r -F
complete -c leo -n "__fish_leo_using_subcommand simulator" -l config -r -F
complete -c leo -n "__fish_leo_using_subcommand simulator" -l stay -d 'Whether the robot keeps running when the lesson is over'
complete -c leo -n "__fish_leo_using_subcommand simulator" -l lockstep -d 'Whether time is simulated, with turns given by a conductor'
complete -c leo -n "__fish_leo_using_subcommand simulator" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand simulator" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand simulator" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand sensor" -l domain -r -F
complete -c leo -n "__fish_leo_using_subcommand sensor" -l incarnation -d 'Incarnation of the process, from one' -r
complete -c leo -n "__fish_leo_using_subcommand sensor" -l parent -d 'Process id of its supervisor, with which it ends; none without supervisor' -r
complete -c leo -n "__fish_leo_using_subcommand sensor" -l kept -d 'Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original files, so that a restarted process has the same configuration' -r -F
complete -c leo -n "__fish_leo_using_subcommand sensor" -l lesson -d 'The lesson to play; default: the built-in one' -r -F
complete -c leo -n "__fish_leo_using_subcommand sensor" -l synthetic -d 'Number of objects of a synthetic lesson, played instead' -r
complete -c leo -n "__fish_leo_using_subcommand sensor" -l partners -d 'Number of partners whose perspective is simulated; default: the configuration\'s value' -r
complete -c leo -n "__fish_leo_using_subcommand sensor" -l state -d 'The state directory; default: nothing is stored' -r -F
complete -c leo -n "__fish_leo_using_subcommand sensor" -l campaign -d 'The fault campaign; default: no faults are injected' -r -F
complete -c leo -n "__fish_leo_using_subcommand sensor" -l config -r -F
complete -c leo -n "__fish_leo_using_subcommand sensor" -l stay -d 'Whether the robot keeps running when the lesson is over'
complete -c leo -n "__fish_leo_using_subcommand sensor" -l lockstep -d 'Whether time is simulated, with turns given by a conductor'
complete -c leo -n "__fish_leo_using_subcommand sensor" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand sensor" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand sensor" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand belief" -l domain -r -F
complete -c leo -n "__fish_leo_using_subcommand belief" -l incarnation -d 'Incarnation of the process, from one' -r
complete -c leo -n "__fish_leo_using_subcommand belief" -l parent -d 'Process id of its supervisor, with which it ends; none without supervisor' -r
complete -c leo -n "__fish_leo_using_subcommand belief" -l kept -d 'Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original files, so that a restarted process has the same configuration' -r -F
complete -c leo -n "__fish_leo_using_subcommand belief" -l lesson -d 'The lesson to play; default: the built-in one' -r -F
complete -c leo -n "__fish_leo_using_subcommand belief" -l synthetic -d 'Number of objects of a synthetic lesson, played instead' -r
complete -c leo -n "__fish_leo_using_subcommand belief" -l partners -d 'Number of partners whose perspective is simulated; default: the configuration\'s value' -r
complete -c leo -n "__fish_leo_using_subcommand belief" -l state -d 'The state directory; default: nothing is stored' -r -F
complete -c leo -n "__fish_leo_using_subcommand belief" -l campaign -d 'The fault campaign; default: no faults are injected' -r -F
complete -c leo -n "__fish_leo_using_subcommand belief" -l config -r -F
complete -c leo -n "__fish_leo_using_subcommand belief" -l stay -d 'Whether the robot keeps running when the lesson is over'
complete -c leo -n "__fish_leo_using_subcommand belief" -l lockstep -d 'Whether time is simulated, with turns given by a conductor'
complete -c leo -n "__fish_leo_using_subcommand belief" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand belief" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand belief" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand learner" -l domain -r -F
complete -c leo -n "__fish_leo_using_subcommand learner" -l incarnation -d 'Incarnation of the process, from one' -r
complete -c leo -n "__fish_leo_using_subcommand learner" -l parent -d 'Process id of its supervisor, with which it ends; none without supervisor' -r
complete -c leo -n "__fish_leo_using_subcommand learner" -l kept -d 'Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original files, so that a restarted process has the same configuration' -r -F
complete -c leo -n "__fish_leo_using_subcommand learner" -l lesson -d 'The lesson to play; default: the built-in one' -r -F
complete -c leo -n "__fish_leo_using_subcommand learner" -l synthetic -d 'Number of objects of a synthetic lesson, played instead' -r
complete -c leo -n "__fish_leo_using_subcommand learner" -l partners -d 'Number of partners whose perspective is simulated; default: the configuration\'s value' -r
complete -c leo -n "__fish_leo_using_subcommand learner" -l state -d 'The state directory; default: nothing is stored' -r -F
complete -c leo -n "__fish_leo_using_subcommand learner" -l campaign -d 'The fault campaign; default: no faults are injected' -r -F
complete -c leo -n "__fish_leo_using_subcommand learner" -l config -r -F
complete -c leo -n "__fish_leo_using_subcommand learner" -l stay -d 'Whether the robot keeps running when the lesson is over'
complete -c leo -n "__fish_leo_using_subcommand learner" -l lockstep -d 'Whether time is simulated, with turns given by a conductor'
complete -c leo -n "__fish_leo_using_subcommand learner" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand learner" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand learner" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand motor" -l domain -r -F
complete -c leo -n "__fish_leo_using_subcommand motor" -l incarnation -d 'Incarnation of the process, from one' -r
complete -c leo -n "__fish_leo_using_subcommand motor" -l parent -d 'Process id of its supervisor, with which it ends; none without supervisor' -r
complete -c leo -n "__fish_leo_using_subcommand motor" -l kept -d 'Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original files, so that a restarted process has the same configuration' -r -F
complete -c leo -n "__fish_leo_using_subcommand motor" -l lesson -d 'The lesson to play; default: the built-in one' -r -F
complete -c leo -n "__fish_leo_using_subcommand motor" -l synthetic -d 'Number of objects of a synthetic lesson, played instead' -r
complete -c leo -n "__fish_leo_using_subcommand motor" -l partners -d 'Number of partners whose perspective is simulated; default: the configuration\'s value' -r
complete -c leo -n "__fish_leo_using_subcommand motor" -l state -d 'The state directory; default: nothing is stored' -r -F
complete -c leo -n "__fish_leo_using_subcommand motor" -l campaign -d 'The fault campaign; default: no faults are injected' -r -F
complete -c leo -n "__fish_leo_using_subcommand motor" -l config -r -F
complete -c leo -n "__fish_leo_using_subcommand motor" -l stay -d 'Whether the robot keeps running when the lesson is over'
complete -c leo -n "__fish_leo_using_subcommand motor" -l lockstep -d 'Whether time is simulated, with turns given by a conductor'
complete -c leo -n "__fish_leo_using_subcommand motor" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand motor" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand motor" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l domain -d 'Domain folder; set by the supervisor alone' -r -F
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l incarnation -d 'Incarnation of the process, from one' -r
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l parent -d 'Process id of its supervisor, with which it ends; none without supervisor' -r
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l kept -d 'Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original files, so that a restarted process has the same configuration' -r -F
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l lesson -d 'The lesson to play; default: the built-in one' -r -F
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l synthetic -d 'Number of objects of a synthetic lesson, played instead' -r
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l partners -d 'Number of partners whose perspective is simulated; default: the configuration\'s value' -r
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l state -d 'The state directory; default: nothing is stored' -r -F
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l campaign -d 'The fault campaign; default: no faults are injected' -r -F
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l config -d 'The robot\'s leo.toml, for the buses and servos in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l fault -d 'A fault to inject from the start; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l faults -d 'A file of faults, `faults = ["SPEC", ..]`, read again whenever it changes' -r -F
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l seed -d 'The seed: the same seed with the same instructions gives the same faults [default: as configured]' -r
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l stay -d 'Whether the robot keeps running when the lesson is over'
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l lockstep -d 'Whether time is simulated, with turns given by a conductor'
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l fast-read-continues-after-gap -d 'Let servos answer a fast read when one before them is silent [default: as configured]'
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand mock-bus" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand console" -l domain -r -F
complete -c leo -n "__fish_leo_using_subcommand console" -l incarnation -d 'Incarnation of the process, from one' -r
complete -c leo -n "__fish_leo_using_subcommand console" -l parent -d 'Process id of its supervisor, with which it ends; none without supervisor' -r
complete -c leo -n "__fish_leo_using_subcommand console" -l kept -d 'Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original files, so that a restarted process has the same configuration' -r -F
complete -c leo -n "__fish_leo_using_subcommand console" -l lesson -d 'The lesson to play; default: the built-in one' -r -F
complete -c leo -n "__fish_leo_using_subcommand console" -l synthetic -d 'Number of objects of a synthetic lesson, played instead' -r
complete -c leo -n "__fish_leo_using_subcommand console" -l partners -d 'Number of partners whose perspective is simulated; default: the configuration\'s value' -r
complete -c leo -n "__fish_leo_using_subcommand console" -l state -d 'The state directory; default: nothing is stored' -r -F
complete -c leo -n "__fish_leo_using_subcommand console" -l campaign -d 'The fault campaign; default: no faults are injected' -r -F
complete -c leo -n "__fish_leo_using_subcommand console" -l config -r -F
complete -c leo -n "__fish_leo_using_subcommand console" -l stay -d 'Whether the robot keeps running when the lesson is over'
complete -c leo -n "__fish_leo_using_subcommand console" -l lockstep -d 'Whether time is simulated, with turns given by a conductor'
complete -c leo -n "__fish_leo_using_subcommand console" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand console" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand console" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand link" -l domain -r -F
complete -c leo -n "__fish_leo_using_subcommand link" -l incarnation -d 'Incarnation of the process, from one' -r
complete -c leo -n "__fish_leo_using_subcommand link" -l parent -d 'Process id of its supervisor, with which it ends; none without supervisor' -r
complete -c leo -n "__fish_leo_using_subcommand link" -l kept -d 'Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original files, so that a restarted process has the same configuration' -r -F
complete -c leo -n "__fish_leo_using_subcommand link" -l lesson -d 'The lesson to play; default: the built-in one' -r -F
complete -c leo -n "__fish_leo_using_subcommand link" -l synthetic -d 'Number of objects of a synthetic lesson, played instead' -r
complete -c leo -n "__fish_leo_using_subcommand link" -l partners -d 'Number of partners whose perspective is simulated; default: the configuration\'s value' -r
complete -c leo -n "__fish_leo_using_subcommand link" -l state -d 'The state directory; default: nothing is stored' -r -F
complete -c leo -n "__fish_leo_using_subcommand link" -l campaign -d 'The fault campaign; default: no faults are injected' -r -F
complete -c leo -n "__fish_leo_using_subcommand link" -l config -r -F
complete -c leo -n "__fish_leo_using_subcommand link" -l stay -d 'Whether the robot keeps running when the lesson is over'
complete -c leo -n "__fish_leo_using_subcommand link" -l lockstep -d 'Whether time is simulated, with turns given by a conductor'
complete -c leo -n "__fish_leo_using_subcommand link" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand link" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand link" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l domain -r -F
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l incarnation -d 'Incarnation of the process, from one' -r
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l parent -d 'Process id of its supervisor, with which it ends; none without supervisor' -r
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l kept -d 'Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original files, so that a restarted process has the same configuration' -r -F
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l lesson -d 'The lesson to play; default: the built-in one' -r -F
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l synthetic -d 'Number of objects of a synthetic lesson, played instead' -r
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l partners -d 'Number of partners whose perspective is simulated; default: the configuration\'s value' -r
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l state -d 'The state directory; default: nothing is stored' -r -F
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l campaign -d 'The fault campaign; default: no faults are injected' -r -F
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l config -r -F
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l stay -d 'Whether the robot keeps running when the lesson is over'
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l lockstep -d 'Whether time is simulated, with turns given by a conductor'
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand torque-guard" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -l config -d 'The robot\'s leo.toml, for the names of its percepts [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -l state -d 'The state directory [default: $XDG_STATE_HOME/leo or ~/.local/state/leo]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -f -a "list" -d 'List the tasks: name, examples, rule'
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -f -a "show" -d 'Show a task: the hypotheses of each perspective, the rule, and the explanation'
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -f -a "forget" -d 'Forget a task and all its examples'
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -f -a "export" -d 'Print tasks with all their examples as one JSON document, to be imported elsewhere'
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -f -a "import" -d 'Import exported tasks: all of them or, if a task is known already, none'
complete -c leo -n "__fish_leo_using_subcommand tasks; and not __fish_seen_subcommand_from list show forget export import help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from list" -l config -d 'The robot\'s leo.toml, for the names of its percepts [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from list" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from list" -l state -d 'The state directory [default: $XDG_STATE_HOME/leo or ~/.local/state/leo]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from list" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from list" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from list" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from list" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from show" -l config -d 'The robot\'s leo.toml, for the names of its percepts [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from show" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from show" -l state -d 'The state directory [default: $XDG_STATE_HOME/leo or ~/.local/state/leo]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from show" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from show" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from show" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from show" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from forget" -l config -d 'The robot\'s leo.toml, for the names of its percepts [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from forget" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from forget" -l state -d 'The state directory [default: $XDG_STATE_HOME/leo or ~/.local/state/leo]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from forget" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from forget" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from forget" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from export" -l config -d 'The robot\'s leo.toml, for the names of its percepts [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from export" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from export" -l state -d 'The state directory [default: $XDG_STATE_HOME/leo or ~/.local/state/leo]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from export" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from export" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from export" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from import" -l config -d 'The robot\'s leo.toml, for the names of its percepts [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from import" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from import" -l state -d 'The state directory [default: $XDG_STATE_HOME/leo or ~/.local/state/leo]' -r -F
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from import" -l replace -d 'Replace known tasks of the same names'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from import" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from import" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from import" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from help" -f -a "list" -d 'List the tasks: name, examples, rule'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from help" -f -a "show" -d 'Show a task: the hypotheses of each perspective, the rule, and the explanation'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from help" -f -a "forget" -d 'Forget a task and all its examples'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from help" -f -a "export" -d 'Print tasks with all their examples as one JSON document, to be imported elsewhere'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from help" -f -a "import" -d 'Import exported tasks: all of them or, if a task is known already, none'
complete -c leo -n "__fish_leo_using_subcommand tasks; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "scan" -d 'List the servos that answer, and compare them with motor.toml'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "read" -d 'Read items of a servo\'s control table by their names, with their units'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "write" -d 'Write an item of a servo\'s control table; `JOINT goal_position 10deg` moves the joint slowly to that angle, within its limits, and waits until it stops'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "torque" -d 'Switch torque on or off: off for all servos if none is named, on for one at its present position'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "reboot" -d 'Reboot a servo, which clears a hardware alert'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "monitor" -d 'Show the state of the servos continuously'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "set-id" -d 'Change the identifier of a servo; connect it alone if two have the same'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "commission" -d 'Run trials on real servos before Leo drives a body, and report what was tried, expected and measured'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "set-baud" -d 'Change the bus speed of a servo'
complete -c leo -n "__fish_leo_using_subcommand bus; and not __fish_seen_subcommand_from scan read write torque reboot monitor set-id commission set-baud help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -l json -d 'Print one JSON document'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -l all-speeds -d 'Scan every other speed too; the default if no servo answers at the speed of the bus'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from scan" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from read" -l id -d 'The servo\'s identifier on the one bus that --bus or --device names' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from read" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from read" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from read" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from read" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from read" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from read" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from read" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from read" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -l id -d 'The servo\'s identifier on the one bus that --bus or --device names' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -l raw -d 'The servo\'s own counts, past the limits of its joint, without a profile'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -l yes -d 'Do not ask for confirmation of --raw'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from write" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -l id -d 'The servo\'s identifier on the one bus that --bus or --device names' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -l raw -d 'The servo\'s own counts, past the limits of its joint, without a profile'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -l yes -d 'Do not ask for confirmation of --raw'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from torque" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from reboot" -l id -d 'The servo\'s identifier on the one bus that --bus or --device names' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from reboot" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from reboot" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from reboot" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from reboot" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from reboot" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from reboot" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from reboot" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from reboot" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -l id -d 'The servo\'s identifier on the one bus that --bus or --device names' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -l once -d 'Show it once'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from monitor" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -l id -d 'The servo\'s identifier on the one bus that --bus or --device names' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -l to -d 'The new identifier' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -l yes -d 'Do not ask for confirmation'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-id" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -l only -d 'Only this trial; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -l report -d 'Folder for the report (a new file `commission-DATE.toml`)' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -l yes -d 'Run the trials that need no person, without questions: torque comes on and joints move'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from commission" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -l id -d 'The servo\'s identifier on the one bus that --bus or --device names' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -l to -d 'Bits per second' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -l config -d 'The robot\'s leo.toml, for the buses and joints in the motor.toml beside it [default: built in]' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -l set -d 'Set a value of the configuration, as in `--set console.address=127.0.0.1:7781`; may be repeated' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -l bus -d 'Only this bus of motor.toml' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -l device -d 'The tty, instead of the one in motor.toml' -r -F
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -l baud -d 'Bits per second [default: as in motor.toml, or 1000000 with --device alone]' -r
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -l yes -d 'Do not ask for confirmation'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -s v -l verbose -d 'Log more to standard error (also: RUST_LOG)'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -l log-json -d 'Write the log on standard error as JSON'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from set-baud" -s h -l help -d 'Print help'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "scan" -d 'List the servos that answer, and compare them with motor.toml'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "read" -d 'Read items of a servo\'s control table by their names, with their units'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "write" -d 'Write an item of a servo\'s control table; `JOINT goal_position 10deg` moves the joint slowly to that angle, within its limits, and waits until it stops'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "torque" -d 'Switch torque on or off: off for all servos if none is named, on for one at its present position'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "reboot" -d 'Reboot a servo, which clears a hardware alert'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "monitor" -d 'Show the state of the servos continuously'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "set-id" -d 'Change the identifier of a servo; connect it alone if two have the same'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "commission" -d 'Run trials on real servos before Leo drives a body, and report what was tried, expected and measured'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "set-baud" -d 'Change the bus speed of a servo'
complete -c leo -n "__fish_leo_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "run" -d 'Run the whole robot: all processes, simulator and mock servo buses included'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "teach" -d 'Play a lesson in lockstep time, as fast as the machine can, and print what Leo learned'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "study" -d 'Play the paper\'s study, with and without perspective taking, beside the paper\'s tables'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "believe" -d 'Process a recorded trace of observations: perception and belief alone, no processes'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "evaluate" -d 'Compare the beliefs about a recorded trace with the truth, by the measures of multi-object tracking'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "learn" -d 'Learn from before-and-after examples in a file: task learning alone, no processes'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "record" -d 'Record a running robot: every buffer\'s bytes, and messages for common viewers'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "view" -d 'Serve a running robot to live viewers, such as Foxglove and Lichtblick'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "replay" -d 'Replay a recording into the belief and learner processes, and compare their output'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "top" -d 'Show a live table of the processes: rates, latencies, overruns, drops, restarts'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "arm" -d 'Arm the joints after a person has checked the robot: on hardware nothing moves before'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "emergency-stop" -d 'Switch every torque off now, and keep it off until it is released'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "check" -d 'Check the whole configuration and the real-time settings of this machine'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "bench" -d 'Measure latencies beside the bare middleware and a bare thread, in one run'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "manual" -d 'Write the manual pages and the shell completions of the package'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "bench-echo" -d 'The other process of `leo bench`'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "simulator" -d 'The workspace, the teacher and Leo\'s body'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "sensor" -d 'Observations to percepts'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "belief" -d 'Percepts to beliefs'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "learner" -d 'Beliefs to tasks, tasks to joint goals'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "motor" -d 'Joint goals to servos, servos to joint states'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "mock-bus" -d 'Serve mock servo buses to any Dynamixel master, with faults on demand'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "console" -d 'Prints events and serves the page'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "link" -d 'Carries frames between this machine and another one'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "torque-guard" -d 'Switches torque off when the supervisor and the motor process have died together'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "tasks" -d 'Show, forget, export or import what Leo has learned'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "bus" -d 'Talk to servos by hand: scan, read, write, torque, reboot, monitor'
complete -c leo -n "__fish_leo_using_subcommand help; and not __fish_seen_subcommand_from run teach study believe evaluate learn record view replay top arm emergency-stop check bench manual bench-echo simulator sensor belief learner motor mock-bus console link torque-guard tasks bus help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from tasks" -f -a "list" -d 'List the tasks: name, examples, rule'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from tasks" -f -a "show" -d 'Show a task: the hypotheses of each perspective, the rule, and the explanation'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from tasks" -f -a "forget" -d 'Forget a task and all its examples'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from tasks" -f -a "export" -d 'Print tasks with all their examples as one JSON document, to be imported elsewhere'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from tasks" -f -a "import" -d 'Import exported tasks: all of them or, if a task is known already, none'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "scan" -d 'List the servos that answer, and compare them with motor.toml'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "read" -d 'Read items of a servo\'s control table by their names, with their units'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "write" -d 'Write an item of a servo\'s control table; `JOINT goal_position 10deg` moves the joint slowly to that angle, within its limits, and waits until it stops'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "torque" -d 'Switch torque on or off: off for all servos if none is named, on for one at its present position'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "reboot" -d 'Reboot a servo, which clears a hardware alert'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "monitor" -d 'Show the state of the servos continuously'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "set-id" -d 'Change the identifier of a servo; connect it alone if two have the same'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "commission" -d 'Run trials on real servos before Leo drives a body, and report what was tried, expected and measured'
complete -c leo -n "__fish_leo_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "set-baud" -d 'Change the bus speed of a servo'
