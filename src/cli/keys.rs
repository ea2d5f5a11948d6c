//! `railhead keys`: creates, lists and revokes API keys, also while services run.

use std::process::ExitCode;

use anyhow::bail;

use crate::cli::commands::{KeysAction, KeysArgs};
use crate::cli::output::{print, print_error};
use crate::cli::serve::block_on;
use crate::jobs::keys::Keyring;
use crate::jobs::model::{BOUND_MAX, Key, Labels};

/// Runs the action on the keys.
pub(super) fn run(args: &KeysArgs) -> anyhow::Result<ExitCode> {
    block_on(act(args))?
}

async fn act(args: &KeysArgs) -> anyhow::Result<ExitCode> {
    let (KeysAction::Create {
        folder, database, ..
    }
    | KeysAction::List { folder, database }
    | KeysAction::Revoke {
        folder, database, ..
    }) = &args.action;
    let data_dir = &folder.data_dir;
    let creates = matches!(args.action, KeysAction::Create { .. });
    let (keys, place) = match &database.database_url {
        Some(url) => (Keyring::open_shared(url).await?, "the database".to_owned()),
        None if !creates && !Keyring::is_there(data_dir) => {
            bail!("{} is not the data folder of a service", data_dir.display());
        }
        None => (
            Keyring::open(data_dir).await?,
            data_dir.display().to_string(),
        ),
    };
    let done = match &args.action {
        KeysAction::Create {
            tenant,
            name,
            read_only,
            labels,
            ..
        } => {
            let labels = bound_labels(labels)?;
            let (key, secret) = keys
                .create(tenant, name.clone(), *read_only, labels)
                .await?;
            print_error(&format!(
                "key {} of tenant {} in {} follows; it is not shown again",
                key.id, key.tenant, place
            ));
            print(&secret)
        }
        KeysAction::List { .. } => print(&table(&keys.list().await?)),
        KeysAction::Revoke { id, .. } => match keys.revoke(id).await? {
            Some(key) => print(&table(&[key])),
            None => bail!("there is no key {id}; `railhead keys list` shows all"),
        },
    };
    keys.close().await;
    done
}

/// The labels of a new key, which must have different keys.
fn bound_labels(given: &[(String, String)]) -> anyhow::Result<Labels> {
    let labels: Labels = given.iter().cloned().collect();
    if labels.len() < given.len() || labels.len() > BOUND_MAX {
        bail!(
            "{} labels are given; at most {BOUND_MAX} with different keys are allowed",
            given.len()
        );
    }
    Ok(labels)
}

/// One line per key, columns separated by tabs.
fn table(keys: &[Key]) -> String {
    let time = |epoch_ms: i64| {
        jiff::Timestamp::from_millisecond(epoch_ms)
            .map_or_else(|_| epoch_ms.to_string(), |time| format!("{time:.0}"))
    };
    let mut lines = vec!["id\ttenant\tcreated\trevoked\tmay\tlabels\tname".to_owned()];
    lines.extend(keys.iter().map(|key| {
        let labels = key
            .labels
            .iter()
            .map(|(key, value)| format!("{key}:{value}"));
        let labels = labels.collect::<Vec<_>>().join(",");
        format!(
            "{}\t{}\t{}\t{}\t{}\t{}\t{}",
            key.id,
            key.tenant,
            time(key.created_at),
            key.revoked_at.map_or_else(|| "-".to_owned(), time),
            if key.read_only { "read" } else { "all" },
            if labels.is_empty() { "-" } else { &labels },
            // Escaped, so that a name cannot send control sequences to the terminal.
            key.name.as_deref().unwrap_or("-").escape_debug()
        )
    }));
    lines.join("\n")
}
