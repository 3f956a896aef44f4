//! The `ripstop` command.

fn main() -> std::process::ExitCode {
    ripstop::cli::main()
}
