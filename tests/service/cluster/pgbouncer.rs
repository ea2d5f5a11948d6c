//! A PgBouncer in transaction mode in front of the PostgreSQL of the tests. It ends with this process.

use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

use crate::cluster::postgres::{at_port, free_port, left_folder, shell, started};
use crate::support::skip;

/// The first version that supports prepared statements in transaction mode.
const FIRST: (u32, u32) = (1, 21);

/// A running pooler. It ends when dropped.
pub struct Pooler {
    port: u16,
    /// A shell that ends the pooler when its standard input closes, however this process ends.
    shell: Child,
}

impl Pooler {
    /// Starts a pooler for the server of a URL with this many sessions per database. Returns `None` after reporting that PgBouncer is not
    /// installed.
    pub fn before(url: &str, sessions: u32) -> Option<Pooler> {
        let Some(program) = program() else {
            skip("there is no PgBouncer of 1.21 or later here");
            return None;
        };
        let (_, server) = at_port(url);
        let (folder, port) = (left_folder("railhead-pgbouncer"), free_port());
        // Every client is accepted as the user of the configured line.
        let settings = format!(
            "[databases]\n* = user=railhead host=127.0.0.1 port={server}\n[pgbouncer]\nlisten_addr = 127.0.0.1\nlisten_port = {port}\n\
             unix_socket_dir =\nauth_type = any\npool_mode = transaction\ndefault_pool_size = {sessions}\nmax_client_conn = 500\n\
             max_prepared_statements = 300\nignore_startup_parameters = options\nserver_tls_sslmode = disable\n"
        );
        std::fs::write(folder.join("pgbouncer.ini"), settings).expect("its settings");
        let script = format!(
            "cd '{data}' && {{ '{program}' -q pgbouncer.ini > /dev/null 2>&1 & }} && read nothing; kill -QUIT $!; wait; rm -rf '{data}'",
            data = folder.display(),
            program = program.display(),
        );
        let ready = || TcpStream::connect(("127.0.0.1", port)).is_ok();
        let shell = started(shell(&folder), &script, ready);
        Some(Pooler { port, shell })
    }

    /// Returns the URL of the same database through the pooler.
    pub fn url(&self, url: &str) -> String {
        at_port(url).0(self.port)
    }
}

impl Drop for Pooler {
    fn drop(&mut self) {
        // When its standard input closes, the shell ends the pooler.
        drop(self.shell.stdin.take());
        let _ = self.shell.wait();
    }
}

/// Returns the path of a PgBouncer that supports prepared statements.
fn program() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    // Debian installs it here, which is not on every user's path.
    folders.push("/usr/sbin".into());
    let programs = folders.into_iter().map(|folder| folder.join("pgbouncer"));
    programs
        .filter(|program| program.is_file())
        .find(|program| version(program).is_some_and(|version| version >= FIRST))
}

fn version(program: &Path) -> Option<(u32, u32)> {
    let said = Command::new(program).arg("--version").output().ok()?;
    let said = String::from_utf8(said.stdout).ok()?;
    let mut numbers = said.split_whitespace().nth(1)?.split('.');
    Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
}
