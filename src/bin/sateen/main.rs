//! The `sateen` tool: a thin client of the library.
//!
//! Data goes to stdout or `-o`, talk to stderr; [`args`] lists what the exit status says.

mod args;
mod bake;
mod cloth;
mod compare;
mod eval;
mod export;
mod fabrics;
mod fit;
mod info;
mod output;
mod picture;
mod record;
mod render;
mod report;
mod scene;
mod stage;
mod stress;
mod subject;
mod validate;

use std::process::ExitCode;

use clap::Parser;

use args::{Args, Verb};

/// How a verb ended, short of an error.
enum Outcome {
    Done,
    OutOfTolerance,
}

fn main() -> ExitCode {
    let args = Args::parse();
    output::be_quiet(args.quiet);
    output::stop_on_interrupt();
    let result = match args.verb {
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
    };
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
