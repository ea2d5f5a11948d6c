//! A PgBouncer of our own before the PostgreSQL of the tests, in transaction mode; gone with the process.

use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

use crate::cluster::postgres::{at_port, free_port, left_folder, shell, started};
use crate::support::skip;

/// The first version that carries prepared statements in transaction mode.
const FIRST: (u32, u32) = (1, 21);

/// A pooler; it ends with this.
pub struct Pooler {
    port: u16,
    /// It ends with the standard input of this shell, however this process ends.
    shell: Child,
}

impl Pooler {
    /// Starts one before the server of a URL, with so many sessions for each database; `None`, said aloud, if there is none on this
    /// machine.
    pub fn before(url: &str, sessions: u32) -> Option<Pooler> {
        let Some(program) = program() else {
            skip("there is no PgBouncer of 1.21 or later here");
            return None;
        };
        let (_, server) = at_port(url);
        let (folder, port) = (left_folder("railhead-pgbouncer"), free_port());
        // Whoever comes is let in as the user of the line.
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

    /// The same database by way of the pooler.
    pub fn url(&self, url: &str) -> String {
        at_port(url).0(self.port)
    }
}

impl Drop for Pooler {
    fn drop(&mut self) {
        // The shell ends the pooler.
        drop(self.shell.stdin.take());
        let _ = self.shell.wait();
    }
}

/// The program, of a version that carries prepared statements.
fn program() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    // Where Debian has it, which not everybody's path names.
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
