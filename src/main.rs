//! The `pao-sim` command.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
