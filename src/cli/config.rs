//! `railhead config`: prints the settings of `serve` and the source of each.

use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command};
use serde_json::{Map, Value, json};

use crate::cli::commands::ServeArgs;

/// Printed instead of a secret.
const MASK: &str = "***";

/// Every setting with its value, its source (`default`, `environment`, `flag`) and its variable, as JSON. Settings whose
/// variable is hidden in the help are secrets, whose values are masked.
pub(super) fn describe(command: &Command, given: &ArgMatches, args: &ServeArgs) -> String {
    let mut settings = Map::new();
    for arg in command.get_arguments() {
        let Some(flag) = arg.get_long().filter(|flag| *flag != "help") else {
            continue;
        };
        settings.insert(flag.to_owned(), setting(arg, given));
    }
    // The only default that depends on the machine.
    if let Some(Value::Object(workers)) = settings.get_mut("workers") {
        workers.insert("value".to_owned(), json!(args.worker_count()));
    }
    let text = serde_json::to_string_pretty(&Value::Object(settings));
    text.unwrap_or_default()
}

fn setting(arg: &Arg, given: &ArgMatches) -> Value {
    let id = arg.get_id().as_str();
    let raw = given.get_raw(id).into_iter().flatten();
    let mut values: Vec<Value> = raw.map(|raw| plain(&raw.to_string_lossy())).collect();
    let value = if arg.is_hide_env_values_set() && !values.is_empty() {
        json!(MASK)
    } else if arg.get_value_delimiter().is_some() {
        Value::Array(values)
    } else {
        values.pop().unwrap_or_default()
    };
    let source = match given.value_source(id) {
        Some(ValueSource::CommandLine) => "flag",
        Some(ValueSource::EnvVariable) => "environment",
        _ => "default",
    };
    let variable = arg.get_env().map(|name| name.to_string_lossy());
    json!({ "value": value, "source": source, "variable": variable })
}

/// Numbers and booleans as JSON values, everything else as text.
fn plain(text: &str) -> Value {
    match serde_json::from_str(text) {
        Ok(value @ (Value::Number(_) | Value::Bool(_))) => value,
        _ => json!(text),
    }
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, FromArgMatches};

    use super::*;
    use crate::cli::commands::{Cli, Command as Asked};

    #[test]
    fn a_secret_is_masked_and_the_rest_is_printed() {
        let mut command = Command::new("x")
            .arg(
                Arg::new("token")
                    .long("token")
                    .env("X_TOKEN")
                    .hide_env_values(true),
            )
            .arg(Arg::new("size").long("size").default_value("3"));
        let given = command
            .try_get_matches_from_mut(["x", "--token", "hush"])
            .unwrap();
        let Asked::Serve(args) =
            Cli::from_arg_matches(&Cli::command().get_matches_from(["railhead", "serve"]))
                .unwrap()
                .command
        else {
            panic!("serve was asked for");
        };
        let described = describe(&command, &given, &args);
        assert!(!described.contains("hush"), "{described}");
        let described: Value = serde_json::from_str(&described).unwrap();
        assert_eq!(described["token"]["value"], MASK);
        assert_eq!(
            described["size"],
            json!({ "value": 3, "source": "default", "variable": null })
        );
    }
}
