//! The `sateen` tool: a thin client of the library.
//!
//! Data goes to stdout or `-o`, talk to stderr.

mod args;
mod bake;
mod cloth;
mod compare;
mod eval;
mod export;
mod fabrics;
mod fit;
mod forecast;
mod guidance;
mod info;
mod manifest;
mod output;
mod picture;
mod record;
mod render;
mod report;
mod scene;
mod shard;
mod stage;
mod stress;
mod subject;
mod validate;
mod verify;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

const EXIT_STATUS: &str = "\
Exit status:
  0  done
  1  error: the message says where and what to do
  2  usage: an argument or a flag is missing or wrong
  3  out of tolerance: a limit, a promise or a comparison does not hold";

/// Bakes fabric BRDFs into small 4D tables, evaluates them, and tells what the approximation costs.
#[derive(Parser)]
#[command(version, max_term_width = 100, after_help = EXIT_STATUS)]
struct Args {
    #[command(subcommand)]
    verb: Verb,
    /// Write only errors to stderr.
    #[arg(short, long, global = true)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Verb {
    Fabrics(fabrics::FabricsArgs),
    Bake(bake::BakeArgs),
    Info(info::InfoArgs),
    Eval(eval::EvalArgs),
    Validate(validate::ValidateArgs),
    Fit(fit::FitArgs),
    Report(report::ReportArgs),
    Stress(stress::StressArgs),
    Render(render::RenderArgs),
    Scene(scene::ExplainArgs),
    Record(record::RecordArgs),
    Export(export::ExportArgs),
    Compare(compare::CompareArgs),
}

/// How a verb ended, short of an error.
enum Outcome {
    Done,
    OutOfTolerance,
}

fn main() -> ExitCode {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(error) => match guidance::of(&error) {
            Some(message) => {
                output::talk(&format!("error: {message}"));
                return ExitCode::from(2);
            }
            None => error.exit(),
        },
    };
    output::be_quiet(args.quiet);
    output::stop_on_interrupt();
    let result = output::check_environment().and_then(|()| run(args.verb));
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::OutOfTolerance) => ExitCode::from(3),
        Err(error) => {
            output::talk(&format!("error: {error:#}"));
            if error.is::<output::Usage>() {
                ExitCode::from(2)
            } else {
                ExitCode::FAILURE
            }
        }
    }
}

fn run(verb: Verb) -> anyhow::Result<Outcome> {
    match verb {
        Verb::Fabrics(args) => fabrics::run(&args),
        Verb::Bake(args) => bake::run(&args),
        Verb::Info(args) => info::run(&args),
        Verb::Eval(args) => eval::run(&args),
        Verb::Validate(args) => validate::run(&args),
        Verb::Fit(args) => fit::run(&args),
        Verb::Report(args) => report::run(&args),
        Verb::Stress(args) => stress::run(&args),
        Verb::Render(args) => render::run(&args),
        Verb::Scene(args) => scene::run(&args),
        Verb::Record(args) => record::run(&args),
        Verb::Export(args) => export::run(&args),
        Verb::Compare(args) => compare::run(&args),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        super::Args::command().debug_assert();
    }
}
