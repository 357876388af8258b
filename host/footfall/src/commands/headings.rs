//! Headings of option groups, and texts shared by several help pages.

/// Options for reading the input.
pub const INPUT: &str = "Input";

/// Options of the estimator.
pub const ESTIMATOR: &str = "Estimator";

/// Options for the output.
pub const OUTPUT: &str = "Output";

/// Meaning of the exit codes.
pub const EXIT_CODES: &str = "\
Exit codes:
  0    done; also where the reader of standard output has gone (| head)
  1    not done: standard error says why
  2    the command line is not understood
  130  interrupted; no unfinished file is left";

/// Examples of the program as a whole.
pub const EXAMPLES: &str = "\
Examples:
  footfall                                   simulate a walk, no files needed
  footfall replay walk.csv --plot walk.svg   estimate a recording, draw it
  footfall calibrate walk.csv --output robot.toml
  footfall config > robot.toml";

/// Examples of `footfall replay`.
pub const REPLAY_EXAMPLES: &str = "\
Examples:
  footfall replay walk.csv --output estimates.csv --plot walk.svg
  footfall replay walk.csv --config robot.toml --from 10 --to 20
  footfall replay log.csv --units g,dps --map ax=acc.x,ay=acc.y,az=acc.z,\\
    wx=gyr.x,wy=gyr.y,wz=gyr.z
  footfall replay a.csv b.csv --json | jq '.recordings[].metrics.rmse'
  footfall replay - --output - < walk.csv | head";

/// Examples of `footfall convert`.
pub const CONVERT_EXAMPLES: &str = "\
Examples:
  footfall convert walk.mcap walk.parquet --load-topic /ft:force.z
  footfall convert log.csv walk.mcap --units g,dps --axes x,-z,y
  footfall convert walk.parquet - --from 10 --to 20 | head";

/// Examples of `footfall view`.
pub const VIEW_EXAMPLES: &str = "\
Examples:
  footfall view demo:feet=4
  footfall view uart:/dev/ttyACM0 --host 0.0.0.0
  footfall view --layout foxglove > footfall.json";

/// Examples of `footfall calibrate`.
pub const CALIBRATE_EXAMPLES: &str = "\
Examples:
  footfall calibrate walk.csv --output robot.toml
  footfall calibrate --rests sides.csv --config robot.toml --output robot.toml
  footfall replay walk.csv --config robot.toml";

/// Examples of `footfall config`.
pub const CONFIG_EXAMPLES: &str = "\
Examples:
  footfall config > robot.toml
  footfall config --check robot.toml";

/// Examples of `footfall completions`.
pub const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  footfall completions bash > ~/.local/share/bash-completion/completions/footfall
  footfall completions zsh > \"${fpath[1]}/_footfall\"
  footfall completions fish > ~/.config/fish/completions/footfall.fish";
